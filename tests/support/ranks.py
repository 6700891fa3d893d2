"""Executors of several processes, with threads in their place: each has a part of the work, and sees no other's."""

from __future__ import annotations

import threading

import numpy as np

from gmsnet.parallel.threads import Serial


class Rank(Serial):
    """One of several. What it is asked for it forms of what all of them give, in an order of its own."""

    sequential = False

    def __init__(self, number, board, meeting):
        self.number, self.board, self.meeting = number, board, meeting
        self.colours = []

    def exchanged(self, value):
        self.board[self.number] = value
        self.meeting.wait()
        values = self.board[self.number :] + self.board[: self.number]
        self.meeting.wait()
        return values

    def total(self, figures):
        return sum(self.exchanged(figures))

    def minimum(self, value):
        values = self.exchanged(value)
        return min(values) if isinstance(value, float) else np.minimum.reduce(values)

    def after_colour(self, colour, points):
        self.colours.append(colour)
        self.meeting.wait()


def ranks_of(count):
    """So many, which wait for each other."""
    board, meeting = [None] * count, threading.Barrier(count, timeout=60)
    return [Rank(number, board, meeting) for number in range(count)]
