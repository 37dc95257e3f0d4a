"""The simulated board's flash. CPython and MicroPython."""

import os

from kickstand_tools.simulated_board.fakes import fake_os

FOLDER = "rides-of-a-test"


def test_a_folder_has_the_room_of_a_pico_s_flash():
    os.mkdir(FOLDER)
    os.mkdir(FOLDER + "/000")
    empty = fake_os.statvfs(FOLDER)
    with open(FOLDER + "/000/one", "wb") as file:
        file.write(bytes(5000))
    taken = fake_os.statvfs(FOLDER)
    os.remove(FOLDER + "/000/one")
    os.rmdir(FOLDER + "/000")
    os.rmdir(FOLDER)
    assert empty[:4] == (4096, 4096, 352, 272)
    assert taken[3] == 270
