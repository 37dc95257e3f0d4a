() => {
  const script = document.createElement("script");
  script.textContent = "window.ours = 1";
  document.body.append(script);
}
