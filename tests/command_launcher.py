"""Hand a command over to the command server: what tests start in place of `python -m agent`, in 15 ms.

It gives the server its arguments, folder, environment and standard streams, passes signals on, and ends as the command
ends. A program that imports little; see `tests/commands.py`.
"""

import marshal
import os
import signal
import socket
import sys

PASSED_ON = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGWINCH, signal.SIGUSR1)


def is_open(descriptor: int) -> bool:
    try:
        os.fstat(descriptor)
    except OSError:
        return False
    return True


def main() -> None:
    numbers = [descriptor for descriptor in range(3) if is_open(descriptor)]
    kept = [os.open(os.devnull, os.O_RDONLY) for _ in range(3 - len(numbers))]  # else the socket took their places
    server = socket.socket(socket.AF_UNIX)
    server.connect(sys.argv[1])
    ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    for number in PASSED_ON:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, lambda received, frame: server.send(bytes([received])))
    content = marshal.dumps(
        (numbers, [os.fsencode(text) for text in sys.argv[2:]], os.getcwdb(), dict(os.environb), ignored)
    )
    socket.send_fds(server, [len(content).to_bytes(8, "big")], numbers)
    server.sendall(content)
    for descriptor in {*numbers, *kept}:
        os.close(descriptor)  # or a pipe would stay open after the command has closed it
    status = server.recv(4)
    code = int.from_bytes(status, "big", signed=True) if status else 70
    if code < 0:
        signal.signal(-code, signal.SIG_DFL) if -code != signal.SIGKILL else None
        os.kill(os.getpid(), -code)
    os._exit(code)


main()
