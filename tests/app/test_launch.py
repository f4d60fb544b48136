import subprocess
import sys

INTERRUPT_EVERY_MOMENT = """
import itertools
import signal
import sys
import threading

from commission.app.launch import interruption

# A suite that runs in the background of a shell ignores Ctrl-C, and this program would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


def is_interrupted_at(moment):
    passed = 0
    is_late = threading.Event()

    def interrupt_at_moment(frame, event, _):
        nonlocal passed
        frame.f_trace_opcodes = True
        if event == "opcode" and not is_late.is_set():
            passed += 1
            if passed == moment:
                signal.raise_signal(signal.SIGINT)
        return interrupt_at_moment

    def interrupt_the_wait():
        is_late.set()
        # In this thread: the other one sleeps on, as when a signal comes just before it falls asleep.
        signal.raise_signal(signal.SIGINT)

    def come_to_wait():
        return wait()

    with interruption() as wait:
        late = threading.Timer(0.5, interrupt_the_wait)
        late.start()
        sys.settrace(interrupt_at_moment)
        come_to_wait()
        sys.settrace(None)
        late.cancel()
    return not is_late.is_set()


print(sum(1 for _ in itertools.takewhile(is_interrupted_at, itertools.count(1))))
"""


def test_ctrl_c_ends_the_wait_whatever_the_program_does_at_that_moment():
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPT_EVERY_MOMENT], capture_output=True, text=True, timeout=60, check=True
    )
    assert int(done.stdout) >= 2
