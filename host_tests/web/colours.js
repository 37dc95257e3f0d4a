() => {
  const style = (one) => getComputedStyle(document.querySelector(one));
  const colour = (one, name) => style(one)[name].match(/[0-9]+/g).map(Number);
  const road = document.createElement("p");
  road.style.color = "var(--road)";
  road.id = "paint";
  document.body.append(road);
  return [colour("#paint", "color"), colour(".mirror", "fill"), colour(".frame", "stroke"),
    colour(".tyre", "stroke")];
}
