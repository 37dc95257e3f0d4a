import pytest
from kickstand_sim.simulated_board.simulator import Board
from panel import panels
from support.board_access import level


@pytest.fixture(autouse=True)
def board(tmp_path, monkeypatch):
    """A board whose flash is an empty directory."""
    monkeypatch.chdir(tmp_path)
    with Board(level, display="ssd1306") as board:
        board.fit_wheel(lambda t_s: 0.0)
        yield board
        while panels:
            panels.pop().app.rides.stop()
