"""The functions that `kickstand check` runs on the board, one after the other.

check.py sends their source code to the board. They only measure, and return a tuple of numbers and texts, which the
arguments of the function of the same name in check.py describe. The argument `parts` is the result of begin(). Times
are in ms unless a name says otherwise.
"""


def begin():
    """Open the parts that all functions use. The app is not running, so it does not use sensor and display."""
    import gc
    import sys

    from kickstand.settings import load

    class Parts:
        settings = load()
        lcd = settings.open_lcd()
        button = settings.open_button()
        sensor = settings.open_sensor()
        version = sys.modules["kickstand"].__version__
        errors = 0  # number of failed transfers in fetch()

        def show(self, line1, line2):
            self.lcd.show(line1, line2)
            self.lcd.flush()

        def fetch(self):
            """Read the FIFO. Returns the number of samples. After an error, restarts the FIFO and returns 0."""
            try:
                return self.sensor.chip.fetch()
            except OSError:
                self.errors += 1
            try:
                self.sensor.chip.start()
            except OSError:
                self.errors += 1
            return 0

    for name in ("WATCHDOG", "RECORD", "LIVE"):
        setattr(Parts.settings, name, False)
    gc.collect()
    return Parts()


def board(parts):
    """Describe the board."""
    import sys

    from kickstand import facts

    has_machine_code = sys.platform in ("rp2", "esp32")  # the firmware uses machine code only on these boards
    chosen = parts.settings
    words = f"{chosen.SAMPLE_HZ} Hz, {chosen.ACCEL_RANGE_G} g, {chosen.GYRO_RANGE_DPS} deg/s, low-pass {chosen.DLPF}"
    version, name, release = facts.board()
    return version, name, release, words, facts.slow_functions() if has_machine_code else ""


def button(parts, wait_ms):
    """Wait for a press of the button. wait_ms: longest time to wait for the press, and then for the release."""
    from time import sleep_ms, ticks_diff, ticks_ms

    held = parts.button.held
    quiet_ms = 60

    def change(to, limit_ms):
        """Wait until the button is steady at `to`. Returns True if the button is steady, and the number of edges."""
        begun = changed = ticks_ms()
        last, edges = held(), 0
        while ticks_diff(ticks_ms(), begun) < limit_ms:
            now = held()
            if now != last:
                last, changed, edges = now, ticks_ms(), edges + 1
            if last == to and edges and ticks_diff(ticks_ms(), changed) >= quiet_ms:
                return True, edges
            sleep_ms(1)
        return last == to, edges

    parts.show("Check: press", "the button")
    at_first = held()
    if at_first:
        sleep_ms(200)  # a weak pull-up may need this time to charge a capacitor
        at_first = held()
    if at_first:
        released, _ = change(False, wait_ms)
        if not released:
            return True, True, False, 0, 0, parts.settings.BUTTON_PIN
    pressed, edges = change(True, wait_ms)
    begun = ticks_ms()
    released, more = change(False, wait_ms) if pressed else (True, 0)
    took = ticks_diff(ticks_ms(), begun)
    parts.show("Check: hold it", "still")
    return at_first, pressed, released, took, edges + more, parts.settings.BUTTON_PIN


def sensor(parts):
    """Set the sensor up."""
    from kickstand.console import sentence
    from kickstand.imu.mpu6050 import UnknownChip

    chip = parts.sensor.chip
    try:
        parts.sensor.set_up()
        standby = chip.read_register(0x6C)
    except (UnknownChip, OSError) as error:
        fault, *_ = parts.sensor.explain(chip, error)
        return "", 0, 0, parts.settings.SENSOR_ADDRESS, sentence(fault), 0
    return chip.name, chip.who_am_i, chip.address, parts.settings.SENSOR_ADDRESS, "", standby


def self_test(parts):
    """Measure the six axes without and with the chip's self-test."""
    from time import sleep_ms

    chip = parts.sensor.chip
    trims = tuple([chip.read_register(0x0D + k) for k in range(4)])

    def means(gyro_config, accel_config):
        chip.write_register(0x1B, gyro_config)
        chip.write_register(0x1C, accel_config)
        sleep_ms(150)
        sums = [0] * 6
        count = 40
        for _ in range(count):
            chip.read()
            for k in range(6):
                sums[k] += chip.counts[k if k < 3 else k + 1]
            sleep_ms(chip.period_ms)
        return tuple([total / count for total in sums])

    off = means(0x00, 0x10)
    on = means(0xE0, 0xF0)
    chip.setup()
    return trims, off, on


def noise(parts, seconds):
    """Measure the noise of the seven channels."""
    from math import sqrt
    from time import sleep_ms, ticks_diff, ticks_ms

    chip = parts.sensor.chip
    chip.start()
    overflows = chip.overflows
    first = last = None
    sums, squares, changes = [0] * 7, [0] * 7, [0] * 7
    count, begun = 0, ticks_ms()
    while ticks_diff(ticks_ms(), begun) < 1000 * seconds:
        for j in range(parts.fetch()):
            chip.take(j)
            counts = list(chip.counts)
            if first is None:
                first = last = counts
            for k in range(7):
                off = counts[k] - first[k]
                sums[k] += off
                squares[k] += off * off
                changes[k] += counts[k] != last[k]
            last = counts
            count += 1
        sleep_ms(2)
    if not count:
        return 0, (), (), (), 1, 1.0, 0.0, 0
    mean = tuple([first[k] + sums[k] / count for k in range(7)])
    spread = tuple([sqrt(max(0, (squares[k] - sums[k] * sums[k] / count) / count)) for k in range(7)])
    temperature = chip.temperature_c(mean[3])
    figures = count, mean, spread, tuple(changes), chip.accel_lsb_per_g, chip.gyro_lsb_per_dps
    return figures + (temperature, chip.overflows - overflows)


def clock(parts, seconds):
    """Measure the clock of the samples, between two times at which the FIFO is empty.

    The last value is False if there are no such times. Then the number of samples does not fit the time between them.
    """
    from time import sleep_ms, ticks_diff, ticks_us

    chip = parts.sensor.chip
    chip.start()
    overflows, errors = chip.overflows, parts.errors

    def emptied():
        """Read until the FIFO is empty just after a sample has arrived.

        Returns the number of samples, the time in us, and False if this has not happened.
        """
        taken = 0
        for _ in range(2000):  # more than 20 ms, the longest period of the samples: a fetch takes over 0.1 ms
            frames = parts.fetch()
            taken += frames
            if frames and not chip.frames_left:
                return taken, ticks_us(), True
        return taken, ticks_us(), False

    _, begun, in_step = emptied()
    count = 0
    while ticks_diff(ticks_us(), begun) < 1_000_000 * seconds:
        count += parts.fetch()
        sleep_ms(10)
    more, ended, in_step_at_end = emptied()
    us, rate_hz = ticks_diff(ended, begun), 1000 // chip.period_ms
    return count + more, us, rate_hz, chip.overflows - overflows, parts.errors - errors, in_step and in_step_at_end


def flash(parts):
    """Write blocks to the flash and read them back."""
    import os
    from time import ticks_diff, ticks_ms

    name, times, wrong, error = "trial.tmp", [], 0, ""
    try:
        for k in range(8):
            content = bytes([k * 31 + 7 & 0xFF]) * 4096
            begun = ticks_ms()
            with open(name, "wb") as file:
                file.write(content)
            times.append(ticks_diff(ticks_ms(), begun))
            with open(name, "rb") as file:
                wrong += file.read() != content
    except OSError as fault:
        error = str(fault)
    try:
        os.remove(name)
    except OSError:
        pass
    space = os.statvfs("/")
    return tuple(times), wrong, space[0] * space[3] // 1024, error


def fifo(parts, writes):
    """Test the sensor's FIFO. writes: 1 to write to the flash during the test, as the recorder of a ride does."""
    from time import sleep_ms, ticks_diff, ticks_ms, ticks_us

    from kickstand.diagnosis import fifo_fault
    from kickstand.imu.mpu6050 import CHIPS

    chip = parts.sensor.chip
    fault = fifo_fault(chip)
    _, (_, _, _, size, _) = CHIPS.get(chip.who_am_i, CHIPS[0x70])
    lasts = size // 14 * chip.period_ms
    if fault:
        return fault.values[0], size, lasts, 0, 0, True, 1
    chip.start()
    begun, begun_us = ticks_ms(), ticks_us()
    while writes and ticks_diff(ticks_ms(), begun) < lasts * 5 // 10:
        with open("trial.tmp", "wb") as file:
            file.write(bytes(512))
        sleep_ms(1)
    while ticks_diff(ticks_ms(), begun) < lasts * 8 // 10:
        sleep_ms(1)
    waiting = chip.waiting()
    expected = ticks_diff(ticks_us(), begun_us) // (1000 * chip.period_ms) * 14
    chip.start()
    overflows = chip.overflows
    sleep_ms(lasts + lasts // 4)
    for _ in range(3):  # the first count may be wrong if the chip is writing a sample at that moment
        parts.fetch()
    noticed = chip.overflows > overflows
    sleep_ms(10 * chip.period_ms)
    return "", size, lasts, waiting, expected, noticed, parts.fetch()


def i2c(parts, transfers):
    """Read the sensor's WHO_AM_I many times."""
    from time import ticks_diff, ticks_us

    chip = parts.sensor.chip
    bus = parts.sensor.reopen()
    chip.connect(bus)
    answer, address, right = bytearray(1), chip.address, chip.who_am_i
    read = bus.readfrom_mem_into
    errors = wrong = 0
    begun = ticks_us()
    for _ in range(transfers):
        try:
            read(address, 0x75, answer)
            if answer[0] != right:
                wrong += 1
        except OSError:
            errors += 1
    return transfers, errors, wrong, ticks_diff(ticks_us(), begun)


def display(parts, rounds):
    """Write texts to the display."""
    from time import sleep_ms

    from kickstand import facts

    lcd, chosen = parts.lcd, parts.settings
    answering, address, draws = 0, 0, False
    for k in range(rounds):
        parts.show("Check: display", f"{k + 1} of {rounds}")
        if lcd.address is not None:
            answering += 1
            address, draws = lcd.address, lcd.draws
        sleep_ms(20)
    fault = ""
    if not answering:
        _, _, _, fault = facts.bus(chosen, "LCD", chosen.LCD_ADDRESSES)
    return address, draws, answering, rounds, fault


def speed(parts):
    """Listen to the speed source."""
    from kickstand import facts

    source, fault, mps = facts.speed(parts.settings)
    return source, ", ".join(fault), mps


def loop(parts, seconds):
    """Run the app for some seconds."""
    import gc
    from time import ticks_diff, ticks_ms

    from kickstand import app as app_module

    gc.collect()
    app = app_module.App(parts.settings, parts.lcd, parts.settings.open_sensor())
    turn, begun, faults, turns = app.turn, ticks_ms(), [], 0
    overflows, restarts = app.sensor.chip.overflows, app.sensor.restarts

    def watched():
        nonlocal turns
        turn()
        turns += 1
        fault = app.sensor.fault
        if fault is not None and fault.code != "starting" and fault.code not in faults:
            faults.append(fault.code)
        if ticks_diff(ticks_ms(), begun) > 1000 * seconds:
            raise KeyboardInterrupt

    app.turn = watched
    try:
        app.run()
    except KeyboardInterrupt:
        pass
    longest_us, places, _ = app_module.worst
    gc.collect()
    free = gc.mem_free() if hasattr(gc, "mem_free") else 1 << 20
    lost = app.clock.lost
    counters = app.sensor.chip.overflows - overflows, lost, app.sensor.restarts - restarts
    parts.show("Check", "done")
    return (longest_us, places) + counters + (", ".join(faults), turns, free)
