// Shows a message if a module cannot be loaded. The browser itself shows nothing.
addEventListener("error", (event) => {
  if (event.target.tagName !== "SCRIPT") return;
  document.getElementById("todo").textContent =
    location.protocol === "file:"
      ? "This page has to come from a web server: “kickstand web” is one."
      : "A file of this page cannot be loaded. Load the page again.";
}, true);
