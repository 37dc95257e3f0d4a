// Opens the first step in a wide window, and a step that a link leads to. It runs before the page is drawn.
const open = (id) => {
  const step = document.getElementById(id);
  if (step?.matches("details")) step.open = true;
};
if (matchMedia("(min-width: 75rem)").matches) open("parts");
open(location.hash.slice(1));
document.addEventListener("click", ({ target }) => open(target.closest("a[href^='#']")?.hash.slice(1)));
