"""The files of the site: links, policies, what is kept offline, archives, documents, and the command that writes it."""

import io
import json
import re
import zipfile
from pathlib import Path
from urllib.parse import urljoin

import pytest
from kickstand_tools.deploy.firmware_files import firmware_files
from kickstand_tools.web import archives, documents, site

ROOT = Path(__file__).resolve().parents[2]
LARGE = "esptool/", "firmware.zip", "install.zip", "numpy/", "plotly/", "pyodide/", "rides.zip", "sample/", "docs/"
BOARDS_PAGES = re.compile(r'<a href="https://micropython\.org/download/\w+/" target="_blank" rel="noopener">')


def pages(files, folder=""):
    return {name: data.decode() for name, data in files.items() if name.endswith(".html") and name.startswith(folder)}


def test_every_document_is_a_page(files):
    found = [
        *ROOT.glob("*.md"),
        *ROOT.glob(".github/*.md"),
        *(ROOT / "firmware").rglob("*.md"),
        *ROOT.glob("tools/*.md"),
    ]
    found += ROOT.glob("tools/docs/*.md")
    assert sorted(documents.PATHS) == sorted(path.relative_to(ROOT).as_posix() for path in found)
    assert set(pages(files, "docs/")) == {
        f"docs/{name}" for name in (*map(documents.page_of, documents.PATHS), "all.html")
    }
    assert {"index.html", "live.html", "install.html", "rides.html"} <= set(files)


def test_every_link_of_a_page_leads_somewhere(files):
    for name, text in pages(files).items():
        assert "{{" not in text and "{%" not in text, name
        for link in re.findall(r'(?:href|src)="([^"]+)"', text):
            if link.startswith(("https://", "data:")):
                continue
            target, _, anchor = urljoin(name, link).partition("#")
            target = target.lstrip("/") or "index.html"
            assert target in files, (name, link)
            assert not anchor or f'id="{anchor}"' in files[target].decode(), (name, link)
        assert f'<h1><a href="{"../" if name.startswith("docs/") else "./"}">' in text, name


def test_site_works_at_any_address(files):
    """Our files name no other server, and no path from the root."""
    ours = {path.relative_to(site.PAGE).as_posix() for path in site.PAGE.rglob("*") if path.is_file()}
    assert ours < set(files)
    for name in ours:
        if name.endswith((".html", ".mjs", ".js", ".css", ".webmanifest")):
            text = BOARDS_PAGES.sub("", files[name].decode().replace("http://www.w3.org/", ""))
            assert "//" not in re.sub(r"(?m)(^|\s)//.*$", "", text), name
            assert not re.search(r"""(src|href|url|fetch)["'=(: ]+/""", text), name


def test_every_page_has_a_policy_and_charts_no_rights(files):
    """Only the site's own scripts run. A framed page of charts has no access to the site or to its stored data."""
    for name, text in pages(files).items():
        (policy,) = re.findall('<meta http-equiv="Content-Security-Policy" content="([^"]+)">', text)
        assert policy.startswith("default-src 'none'; base-uri 'none'; form-action 'none'; script-src 'self'"), name
        assert "'unsafe-inline'" not in policy.partition("style-src")[0] and "http" not in policy, name
        assert "'unsafe-eval'" not in policy or name == "rides.html", name
        assert not re.findall('<script>| on[a-z]+="', text), name
        assert "<iframe" not in text or name == "rides.html", name
    assert 'sandbox="allow-scripts allow-downloads"' in files["rides.html"].decode()


def test_the_service_worker_keeps_all_small_files(files):
    """A visitor loads less than 2.5 MB before a large file is needed."""
    listed = re.search(r"const FILES = (\[.*?\]);", files["service_worker.js"].decode())
    assert listed
    small = {name for name in files if not name.startswith(LARGE)}
    assert set(json.loads(listed[1])) == {"./", *small} - {"service_worker.js", "index.html"}
    assert sum(len(files[name]) for name in small) < 2_500_000
    sizes = json.loads(files["sizes.json"])
    assert sizes["install.zip"] == len(files["install.zip"]) and "index.html" not in sizes


def archive(files, name):
    packed = zipfile.ZipFile(io.BytesIO(files[name]))
    return {name: packed.read(name) for name in packed.namelist()}


def test_browser_without_serial_ports_offers_the_firmware(files):
    """The files form a folder that mpremote can copy."""
    packed = {name.removeprefix("kickstand-firmware"): data for name, data in archive(files, "firmware.zip").items()}
    assert packed == {name: path.read_bytes() for name, path in firmware_files().items()}


def test_each_board_gets_its_own_machine_code(files):
    """Two modules contain machine code. All other files are the same for every board."""
    packed = archive(files, "install.zip")
    modules = {name[1:-2] + "mpy" for name in firmware_files() if name.startswith("/kickstand/")}
    first, *other_architectures = archives.ARCHITECTURES
    compiled = {
        arch: {name.removeprefix(f"compiled/{arch}/") for name in packed if name.startswith(f"compiled/{arch}/")}
        for arch in archives.ARCHITECTURES
    }
    assert {f"kickstand/{name}" for name in compiled[first]} == modules
    machine_code = {name for name in modules if packed[f"compiled/{first}/{name.removeprefix('kickstand/')}"][2]}
    for other in other_architectures:
        assert {f"kickstand/{name}" for name in compiled[other]} == machine_code
    assert len(machine_code) == 2 and {name for name in modules if name.endswith("_viper.mpy")} == machine_code


@pytest.mark.parametrize(
    ("board", "settings"),
    [
        ("Seeed XIAO RP2040, RP2350", {"SENSOR_SDA": "6", "SENSOR_SCL": "7", "LCD_SDA": "0", "SENSOR_I2C": "1"}),
        ("Seeed XIAO ESP32C3", {"LCD_SDA": "4", "LCD_SCL": "5", "BUTTON_PIN": "10"}),
    ],
)
def test_the_page_install_knows_the_boards_of_the_manual(files, board, settings):
    boards = json.loads(files["boards.json"])
    assert settings.items() <= boards[board].items()
    assert all(
        {"SENSOR_SDA", "SENSOR_SCL", "LCD_SDA", "LCD_SCL", "BUTTON_PIN"} <= set(pins) for pins in boards.values()
    )


@pytest.mark.parametrize(
    ("described", "names"),
    [
        ("Raspberry Pi Pico with RP2040, MicroPython 1.26.1", {"Seeed XIAO RP2040, RP2350", "Waveshare RP2040-Zero"}),
        ("Generic ESP32C3 module with ESP32C3", {"Seeed XIAO ESP32C3", "SuperMini ESP32-C3"}),
        ("Generic ESP32-S3 module with ESP32-S3", {"Seeed XIAO ESP32S3", "LILYGO T-Display-S3 (ESP32-S3)"}),
        ("Generic ESP32 module with ESP32", {"M5Stack Atom Lite (ESP32-PICO-D4)", "LILYGO T-Display (ESP32)"}),
        ("Generic H2 module with ESP32H2", set()),
    ],
)
def test_a_board_is_offered_for_its_chip(node, described, names):
    script = """async ({ names, described }) => {
      const { sameChip } = await import(PAGE + "/install/boards.mjs");
      return names.filter((name) => sameChip(name, described));
    }"""
    offered = set(node(script, {"names": list(site.shop_boards()), "described": described}))
    assert offered == set() if not names else offered >= names and len(offered) < 8


def test_a_page_lists_all_documents_and_its_own_headings(files):
    for name, text in pages(files, "docs/").items():
        listed = re.findall(r'<a href="\./([\w-]+\.html)"', re.findall('<nav class="all".*?</nav>', text, re.S)[0])
        assert {f"docs/{page}" for page in listed} == set(pages(files, "docs/"))
        assert text.count('aria-current="page"') == 2, name
        headings = re.findall(r'<h3 id="([^"]+)"', text)
        if headings and not name.endswith(documents.ALL):
            (nav,) = re.findall('<nav class="here".*?</nav>', text, re.S)
            assert re.findall(r'class="level-2"><a href="#([^"]+)"', nav) == headings


def test_one_page_has_all_the_words(files):
    def words(text):
        return re.sub(r"<[^>]+>", " ", re.findall("<article>(.*?)</article>", text, re.S)[0]).split()

    together = files[f"docs/{documents.ALL}"].decode()
    single = [word for path in documents.PATHS for word in words(files[f"docs/{documents.page_of(path)}"].decode())]
    assert words(together)[-len(single) :] == single
    anchors = re.findall(r' id="([^"]+)"', together)
    assert len(anchors) == len(set(anchors))
