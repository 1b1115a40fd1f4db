"""`python -m tests.faults.cable ONE OTHER LOSS DELAY_S`: hands every frame of one link to another, lossy or late."""

from __future__ import annotations

import array
import fcntl
import heapq
import itertools
import random
import select
import socket
import struct
import sys
import time

_OFFLOADS = (0x17, 0x1F, 0x24, 0x2C)
"""ETHTOOL_STXCSUM, STSO, SGSO, SGRO: what a kernel leaves to the hardware, and a frame that is handed on needs."""
_SIOCETHTOOL = 0x8946
_OUTGOING = 4


def main(one: str, other: str, loss: float, delay_s: float) -> None:
    """Runs until it is terminated."""
    links = [_opened(name) for name in (one, other)]
    late: list[tuple[float, int, int, bytes]] = []
    count = itertools.count()
    draw = random.Random(1)
    while True:
        wait_s = max(0.0, late[0][0] - time.monotonic()) if late else 1.0
        ready, _, _ = select.select(links, [], [], wait_s)
        now_s = time.monotonic()
        for link in ready:
            frame, where = link.recvfrom(65536)
            if where[2] != _OUTGOING and draw.random() >= loss:
                heapq.heappush(late, (now_s + delay_s, next(count), 1 - links.index(link), frame))
        while late and late[0][0] <= now_s:
            _, _, place, frame = heapq.heappop(late)
            try:
                links[place].send(frame)
            except OSError:
                continue  # a link that is down, or a frame longer than it takes: it is lost


def _opened(name: str) -> socket.socket:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asker:
        for command in _OFFLOADS:
            value = array.array("B", struct.pack("II", command, 0))
            fcntl.ioctl(asker, _SIOCETHTOOL, struct.pack("16sP", name.encode(), value.buffer_info()[0]))
    link = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
    link.bind((name, 0))
    link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    return link


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4]))
