// Lists the headings that contain all words of the search.
const root = document.currentScript.dataset.root;
const input = document.querySelector("nav input");
const found = document.getElementById("found");
input.addEventListener("input", () => {
  const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
  const fits = ([heading, page]) => words.every((word) => `${heading} ${page}`.toLowerCase().includes(word));
  const links = words.length === 0 ? [] : places.filter(fits).slice(0, 30).map(([heading, page, place]) => {
    const link = document.createElement("a");
    link.href = root + place;
    link.textContent = heading === page ? page : `${page}: ${heading}`;
    return link;
  });
  found.replaceChildren(...links);
});
