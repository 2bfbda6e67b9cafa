"""Drives `sim --interactive` in a terminal of its own: `python3 terminal.py PROGRAM CHART`.

For each way to end a session it prints how the session ended, whether it wrote its recording, and whether the terminal is as it was.
"""

import fcntl
import os
import pty
import select
import signal
import struct
import sys
import termios
import time

PATIENCE = 60


def start(program, arguments):
    """The process, the side of the terminal that a person has, and the side of the program."""
    person, inside = pty.openpty()
    fcntl.ioctl(inside, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 120, 0, 0))
    process = os.fork()
    if process == 0:
        os.setsid()
        fcntl.ioctl(inside, termios.TIOCSCTTY, 0)
        for number in range(3):
            os.dup2(inside, number)
        os.execv(program, [program, *arguments])
    return process, person, inside


class Screen:
    """What the terminal shows to the person."""

    def __init__(self, person):
        self.person = person
        self.text = b""

    def until(self, mark):
        """Reads up to a mark, and takes what was before it."""
        end = time.monotonic() + PATIENCE
        while mark not in self.text:
            if time.monotonic() > end:
                sys.exit(f"{mark!r} did not appear: {self.text!r}")
            if select.select([self.person], [], [], 0.1)[0]:
                self.text += os.read(self.person, 4096)
        self.text = self.text.split(mark, 1)[1]


def wait_for_mode(inside, is_by_lines):
    """Until the terminal delivers whole lines, or each key at once."""
    end = time.monotonic() + PATIENCE
    while bool(termios.tcgetattr(inside)[3] & termios.ICANON) != is_by_lines:
        if time.monotonic() > end:
            sys.exit("the terminal did not change its mode")
        time.sleep(0.01)


def ended(process):
    """How a process ended."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        found, status = os.waitpid(process, os.WNOHANG)
        if found:
            code = os.waitstatus_to_exitcode(status)
            return f"exit code {code}" if code >= 0 else signal.Signals(-code).name
        time.sleep(0.01)
    os.kill(process, signal.SIGKILL)
    sys.exit("the session did not end")


def session(name, end, program, chart):
    recording = f"{name}.csv"
    process, person, inside = start(program, ["sim", chart, "--interactive", "--record", recording])
    before = termios.tcgetattr(inside)
    screen = Screen(person)
    screen.until(b"q quit")
    wait_for_mode(inside, False)
    # The third input is a number: its value is typed as a line, which the terminal shows.
    os.write(person, b"3")
    screen.until(b"depth=")
    wait_for_mode(inside, True)
    os.write(person, b"7\n")
    screen.until(b"q quit")
    wait_for_mode(inside, False)
    os.write(person, b"1 ")
    screen.until(b"reaction 1,")
    screen.until(b"q quit")
    wait_for_mode(inside, False)
    end(process, person)
    how = ended(process)
    is_same = termios.tcgetattr(inside) == before
    written = "recording" if os.path.exists(recording) else "no recording"
    print(f"{name}: {how}, {written}, terminal {'as before' if is_same else 'changed'}")
    os.close(person)
    os.close(inside)


def main():
    program, chart = sys.argv[1:]
    for name, end in [
        ("q", lambda _, person: os.write(person, b"q")),
        ("ctrl-d", lambda _, person: os.write(person, b"\x04")),
        ("ctrl-c", lambda _, person: os.write(person, b"\x03")),
        ("term", lambda process, _: os.kill(process, signal.SIGTERM)),
    ]:
        session(name, end, program, chart)


main()
