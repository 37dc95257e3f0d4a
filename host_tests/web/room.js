(steps) => {
  const [todo, button, guide] = ["#todo", "#do", ".guide"].map((one) => document.querySelector(one));
  button.hidden = false;
  button.textContent = "Put it on its stand";
  todo.textContent = "";
  const bottom = guide.getBoundingClientRect().bottom;
  const long = steps.filter((text) => {
    todo.textContent = text;
    const moved = guide.getBoundingClientRect().bottom !== bottom;
    return moved || button.getBoundingClientRect().bottom > bottom - 8;
  });
  const all = document.createRange();
  all.selectNodeContents(document.querySelector('#press-help'));
  return [long, all.getBoundingClientRect().right];
}
