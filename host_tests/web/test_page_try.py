"""The page Try in Chromium: used by the keyboard alone, with room for every step, and with a missing file."""

import re

import pytest
from support.web.rider import LAPTOP, Rider

ACTIVE = "document.activeElement.id || document.activeElement.value"


def tab_to(rider, name):
    """Press the Tab key until this control has the focus."""
    for _ in range(20):
        rider.page.keyboard.press("Tab")
        if rider.page.evaluate(ACTIVE) == name:
            return
    raise AssertionError(f"no Tab leads to {name}")


def says(rider, selector, text):
    rider.page.wait_for_function("([one, text]) => document.querySelector(one).value === text", arg=[selector, text])


def test_by_the_keyboard_alone(chromium, address):
    """The arrow keys change the lean, and the space bar is the board's button. Controls that the rider cannot move
    show what the motorcycle does. The focus stays when the guide shows its next step."""
    rider = Rider(chromium, address, **LAPTOP)
    rider.reads("Raw")
    says(rider, "#lean-out", "12° left")
    assert rider.page.is_disabled("#speed")
    assert rider.page.input_value("#speed") == "0"
    tab_to(rider, "ride")
    rider.keys("Space", 1)
    says(rider, "#speed-out", "54 km/h")
    rider.keys("ArrowUp", 1)
    rider.keys("ArrowRight", 2)
    says(rider, "#speed-out", "64 km/h")
    says(rider, "#lean-out", "10° right")
    assert rider.page.get_attribute("#pose [value=ride]", "aria-pressed") == "true"
    rider.guide_says("Put the motorcycle on its stand first")
    rider.page.focus("#do")
    rider.page.eval_on_selector("#pose [value=kickstand]", "button => button.click()")
    rider.page.wait_for_selector("#do", state="hidden")
    assert rider.page.evaluate(ACTIVE) == "press"
    says(rider, "#speed-out", "0 km/h")
    assert rider.page.is_disabled("#speed")
    tab_to(rider, "ride")
    rider.keys("Enter", 1)
    says(rider, "#speed-out", "64 km/h")
    assert rider.page.get_attribute("#speed", "min") == "20"
    rider.guide_says("Put the motorcycle on its stand first")
    rider.keys("Space", 1)
    rider.reads("Stand: hold")
    rider.page.focus("#do")
    rider.keys("Enter", 1)
    assert rider.page.evaluate(ACTIVE) == "press"
    assert rider.page.get_attribute("#pose [value=kickstand]", "aria-pressed") == "true"
    assert rider.moved() == []
    rider.context.close()


def test_every_step_has_its_room(chromium, address, files):
    """A longer text must not move the parts of the page below it. The texts come from the guide's source, so the
    longest text is included."""
    guide = files["guide.mjs"].decode()
    pages = re.findall(r'^  \w+: "(.{20,})",$', guide, re.M)
    steps = [text for pair in re.findall(r'"([^"\n]{25,})"|`([^`]{25,})`', guide) for text in pair if text]
    steps += [text.replace("${PAGES[kind]}", page) for text in steps for page in pages if "${PAGES[kind]}" in text]
    assert len(steps) > 40
    rider = Rider(chromium, address + "index.html")
    rider.reads("Raw")
    for width, height in (1440, 900), (1000, 700), (844, 390), (640, 900), (390, 844), (360, 640):
        rider.page.set_viewport_size({"width": width, "height": height})
        assert rider.fits(), width
        long = rider.page.evaluate(
            """(steps) => {
              const [todo, button, guide] = ["#todo", "#do", ".guide"].map((one) => document.querySelector(one));
              button.hidden = false;
              button.textContent = "Put it on its stand";
              todo.textContent = "";
              const bottom = guide.getBoundingClientRect().bottom;
              return steps.filter((text) => {
                todo.textContent = text;
                const moved = guide.getBoundingClientRect().bottom !== bottom;
                return moved || button.getBoundingClientRect().bottom > bottom - 8;
              });
            }""",
            steps,
        )
        assert long == [], width
    rider.context.close()


MISSING_FILES = {
    "python.json": "./python.json cannot be loaded (HTTP 404)",
    "micropython/micropython.wasm": "./micropython/micropython.wasm cannot be loaded (HTTP 404)",
    "bike.mjs": "file of this page cannot be loaded",
}


@pytest.mark.parametrize("name", MISSING_FILES)
def test_a_missing_file_is_told_in_one_line(chromium, address, name):
    context = chromium.new_context()
    context.route(f"**/{name}", lambda route: route.fulfill(status=404, body="not here"))
    page = context.new_page()
    page.goto(address)
    words = MISSING_FILES[name]
    page.wait_for_function("text => document.querySelector('#todo').textContent.includes(text)", arg=words)
    assert page.inner_text("#todo").endswith("Load the page again.")
    context.close()
