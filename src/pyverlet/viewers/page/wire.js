// The words on the wire, see protocol.py: a JSON head, then arrays of numbers or a JPEG.

/** One message of the server, its arrays as views on `data`, an ArrayBuffer. */
export function unpack(data) {
  const length = new DataView(data).getUint32(0, true), start = 4 + length;
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  if (head.kind === "shape" && !head.drawnHere) {
    head.radius = new Float32Array(data, start, head.count);
    head.mass = new Float32Array(data, start + 4 * head.count, head.count);
    head.number = new Uint32Array(data, start + 8 * head.count, head.count);
    const pairs = start + 12 * head.count, kinds = pairs + 8 * head.apart;
    head.apart = new Uint32Array(data, pairs, 2 * head.apart);
    head.kinds = head.kinds ? new Uint32Array(data, kinds, 2 * head.count) : null;
    head.rgb = head.coloured ? new Uint8Array(data, kinds + (head.kinds ? 8 * head.count : 0), 3 * head.count) : null;
  } else if (head.kind === "shape") {
    Object.assign(head, { radius: new Float32Array(0), mass: new Float32Array(0), number: new Uint32Array(0), apart: new Uint32Array(0), kinds: null, rgb: null });
  } else if (head.kind === "frame") {
    const links = head.links ?? 0, copies = head.copies ?? 0, touches = head.contacts ?? 0;
    const pairs = (data.byteLength - start - 9 * links - 8 * copies - 10 * touches) / ((head.unit ? 8 : 4) + (head.turned ? 1 : 0));
    head.grid = new Uint16Array(data, start, 2 * pairs);
    head.velocity = head.unit ? new Int16Array(data, start + 4 * pairs, 2 * pairs) : null;
    const twice = start + pairs * (head.unit ? 8 : 4), behind = twice + 8 * copies;
    head.copies = copies ? { owner: new Uint32Array(data, twice, copies), places: new Uint16Array(data, twice + 4 * copies, 2 * copies) } : null;
    head.joined = new Uint32Array(data, behind, 2 * links);
    head.strain = new Uint8Array(data, behind + 8 * links, links);
    const last = data.byteLength - 10 * touches; // at any byte: copied, since an array of numbers must begin at a multiple of four
    head.touching = new Uint32Array(data.slice(last, last + 8 * touches));
    head.pushes = new Uint8Array(data, last + 8 * touches, touches);
    head.normals = new Uint8Array(data, last + 9 * touches, touches);
    head.turned = head.turned ? new Uint8Array(data, behind + 9 * links, pairs) : null;
  } else if (head.kind === "picture") {
    head.jpeg = new Blob([new Uint8Array(data, start)], { type: "image/jpeg" });
  }
  return head;
}
