(seconds) => new Promise((done) => {
  const seen = [], until = Date.now() + 1000 * seconds;
  const text = (id) => document.querySelector(id).textContent;
  const timer = setInterval(() => {
    seen.push([document.querySelector("#display").ariaLabel, text("#shown-lean"), text("#todo")]);
    if (Date.now() > until) { clearInterval(timer); done(seen); }
  }, 20);
})
