"""The app's loop: its rate and its garbage collections."""

import pytest
from kickstand_sim.simulated_board.fakes import fake_time
from support import device_runs


def test_loop_has_100_turns_a_second_and_never_catches_up(with_app):
    def use(board, app):
        app.begin()
        for _ in range(100):  # until display and sensor are set up
            app.step()
        begin_us = board.clock.now_us
        for _ in range(50):
            app.step()
        lasted_us = board.clock.now_us - begin_us
        board.clock.at(board.clock.now_us, lambda: board.clock.advance(35_000))
        app.step()
        late_us = board.clock.now_us
        app.step()
        return lasted_us, board.clock.now_us - late_us

    lasted_us, after_us = with_app(use)
    assert lasted_us == pytest.approx(500_000, abs=1000) and after_us == pytest.approx(10_000, abs=1000)


@pytest.mark.parametrize(("chip", "processor_hz"), [("esp32", 240_000_000), ("pico", 160_000_000)])
def test_an_esp32_runs_at_240_mhz_and_yields(chip, processor_hz, monkeypatch):
    """Only sleep_ms() gives time to an ESP32's idle task and its radio. A Pico keeps its clock."""
    waits_ms, sleep_ms = [], fake_time.sleep_ms
    monkeypatch.setattr(fake_time, "sleep_ms", lambda ms: waits_ms.append(ms) or sleep_ms(ms))
    device = device_runs.Device(lambda t_s: (0.0, 1.0, 0.0, 0.0, 0.0, 0.0), machine=chip)
    device.run({}, [3.0])
    assert device.board.processor_hz == processor_hz
    assert (sum(ms >= 5 for ms in waits_ms) > 100) is (chip == "esp32")
