/** three.js, which the page carries packed; see vendor/README.md. */

await new Promise((done) => requestAnimationFrame(() => setTimeout(done))); // the page is seen first, with its still
const packed = document.getElementById("three").textContent;
const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
const text = await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();

export default await import(URL.createObjectURL(new Blob([text], { type: "text/javascript" })));
