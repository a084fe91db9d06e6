// A figure that is reduced to the width of the page, as on a phone, is a link to itself in full size.
addEventListener("load", () => {
  for (const image of document.querySelectorAll(".bd-article img[alt]")) {
    if (!image.alt || image.closest("a") || image.naturalWidth <= image.clientWidth) continue;
    const link = document.createElement("a");
    link.href = image.src;
    image.replaceWith(link);
    link.append(image);
  }
});
