// The words on the wire, see protocol.py: a JSON head, then arrays of numbers or a JPEG.

/** The head of a message, an ArrayBuffer; what takes the arrays behind it one by one, as views on it; and what says how many bytes are left. */
export function opened(data) {
  const length = new DataView(data).getUint32(0, true), head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  let at = 4 + length;
  const take = (Kind, size) => {
    const array = new Kind(data, at, size);
    at += array.byteLength;
    return array;
  };
  return { head, take, left: () => data.byteLength - at };
}

/** One message of the server. */
export function unpack(data) {
  const { head, take, left } = opened(data);
  if (head.kind === "shape") {
    const count = head.drawnHere ? 0 : head.count;
    for (const [name, Kind] of [["radius", Float32Array], ["mass", Float32Array], ["number", Uint32Array]]) head[name] = take(Kind, count);
    head.apart = take(Uint32Array, 2 * head.apart);
    head.kinds = count && head.kinds ? take(Uint32Array, 2 * count) : null;
    head.rgb = count && head.coloured ? take(Uint8Array, 3 * count) : null;
  } else if (head.kind === "frame") {
    const { links = 0, copies = 0, contacts = 0 } = head, each = (head.unit ? 8 : 4) + (head.turned ? 1 : 0);
    const count = (left() - 9 * links - 8 * copies - 10 * contacts) / each;
    head.grid = take(Uint16Array, 2 * count);
    head.velocity = head.unit ? take(Int16Array, 2 * count) : null;
    head.copies = copies ? { owner: take(Uint32Array, copies), places: take(Uint16Array, 2 * copies) } : null;
    head.joined = take(Uint32Array, 2 * links);
    head.strain = take(Uint8Array, links);
    head.turned = head.turned ? take(Uint8Array, count) : null;
    head.touching = new Uint32Array(take(Uint8Array, 8 * contacts).slice().buffer); // copied: here may be no multiple of four
    head.pushes = take(Uint8Array, contacts);
    head.normals = take(Uint8Array, contacts);
  } else if (head.kind === "picture") {
    head.jpeg = new Blob([take(Uint8Array, left())], { type: "image/jpeg" });
  }
  return head;
}
