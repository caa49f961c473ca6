/* Pages opened from a disk may not start workers, and search is one: there it runs in a hidden frame instead.
   (MkDocs Material looks for a script of this name, and fetches one from elsewhere if there is none.) */
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(address) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      const inside = frame.contentWindow;
      const loaded = (script) => new Promise((resolve, reject) => {
        const element = inside.document.createElement("script");
        Object.assign(element, { src: script, onload: resolve, onerror: reject });
        inside.document.head.append(element);
      });
      inside.importScripts = (...scripts) => Promise.all(scripts.map(loaded));
      inside.postMessage = (data) => {
        const message = new MessageEvent("message", { data });
        this.dispatchEvent(message);
        this.onmessage?.(message);
      };
      this.frame = frame;
      this.ready = loaded(address);
    }

    postMessage(data) {
      const inside = this.frame.contentWindow;
      this.ready.then(() => inside.dispatchEvent(new inside.MessageEvent("message", { data })));
    }

    terminate() {
      this.frame.remove();
    }
  };
}
