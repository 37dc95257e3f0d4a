"""What the tests share: boards, devices and programs to run, and what they show. Some of it runs on MicroPython too."""
