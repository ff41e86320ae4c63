// The studio in a cell of a notebook: a frame with its page, and what passes between that and the kernel.

export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.title = "Trunnion studio";
    frame.style = `width: 100%; height: ${model.get("height")}px; border: 1px solid #8886; border-radius: 6px`;
    const sent = ({ source, data }) => {
      if (source !== frame.contentWindow || !data?.trunnion) return;
      const { trunnion: id, path, method, question, body } = data;
      const bytes = typeof body === "string" ? new TextEncoder().encode(body) : body;
      model.send({ id, path, method, question }, undefined, bytes ? [bytes] : []);
    };
    const answered = (message, buffers) => {
      if (message.page) return void (frame.srcdoc ||= message.page);
      const { buffer, byteOffset, byteLength } = buffers[0];
      const body = buffer.slice(byteOffset, byteOffset + byteLength);
      frame.contentWindow?.postMessage({ trunnion: message.id, status: message.status, body }, "*");
    };
    window.addEventListener("message", sent);
    model.on("msg:custom", answered);
    el.append(frame);
    model.send({ page: true });
    return () => {
      window.removeEventListener("message", sent);
      model.off("msg:custom", answered);
      frame.remove();
    };
  },
};
