"""What only developers of Kickstand run. It is in the checkout and in no wheel; commands.py adds to `kickstand` there.

bench/ and soak/ measure and try the firmware, evaluation/ compares it with other filters, pictures/ draws the READMEs'
pictures, mutants/ judges the tests.
"""

# As in kickstand_tools/cli/main.py
COMMANDS = {
    "bands": ("kickstand_workshop.commands", "How rough simulated roads are, beside recorded rides."),
    "bench": ("kickstand_workshop.commands", "Time, memory and flash of the firmware on an emulated Pico."),
    "evaluate": ("kickstand_workshop.commands", "Compare the shown lean with the truth of simulated rides."),
}
