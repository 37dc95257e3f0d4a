"""`dev.py test --changed` runs each test that a change can reach by imports, and not every test."""

import pytest
from kickstand_workshop.reach import reached_tests


@pytest.mark.parametrize(
    ("changed", "reached", "not_reached"),
    [
        ("host_tests/test_arrows.py", "host_tests/test_arrows.py", "signals"),
        ("tools/fleet/kickstand_fleet/manifest.py", "tools/fleet/tests", "host_tests/lean"),
        ("firmware/kickstand/ui/pages.py", "host_tests/ui", "host_tests/signals"),
        ("firmware/kickstand/lean/lean_filter.py", "host_tests/device", "host_tests/joining/test_none"),
        ("tools/kickstand_tools/web/page/shows.mjs", "host_tests/web", "host_tests/imu"),
        ("host_tests/support/fake_board.py", "host_tests/deploy", "host_tests/lean"),
        ("host_tests/support/plugin.py", "tools/emulator/tests", None),
        ("pyproject.toml", "host_tests/signals", None),
    ],
)
def test_a_change_reaches_its_tests(changed, reached, not_reached):
    tests = reached_tests([changed])
    assert any(test.startswith(reached) for test in tests)
    assert not_reached is None or not any(test.startswith(not_reached) for test in tests)
