"""A communicator of several ranks, with threads in their place: as much of mpi4py's as gmsnet.distributed uses."""

from __future__ import annotations

import pickle
import queue
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import numpy as np
from mpi4py import MPI

OPERATIONS = (
    (MPI.SUM, lambda values: sum(values[1:], values[0])),
    (MPI.MIN, np.minimum.reduce),
    (MPI.MAX, np.maximum.reduce),
    (MPI.LOR, any),
)


def combined(operation, values):
    return next(combine for known, combine in OPERATIONS if known == operation)(values)


class Meeting:
    """As threading.Barrier, at half its cost: who wakes up needs no lock that all others want too."""

    def __init__(self, count):
        self.lock, self.count, self.came, self.broken = threading.Lock(), count, 0, False
        self.gates = [threading.Lock() for _ in range(count)]
        for gate in self.gates:
            gate.acquire()

    def wait(self, rank):
        with self.lock:
            self.came = (self.came + 1) % self.count
            last = self.came == 0
        if last and not self.broken:
            self._open(gate for other, gate in enumerate(self.gates) if other != rank)
        elif self.broken or not self.gates[rank].acquire(timeout=120) or self.broken:
            raise threading.BrokenBarrierError

    def abort(self):
        self.broken = True
        self._open(self.gates)

    def _open(self, gates):
        for gate in gates:
            with suppress(RuntimeError):  # it is open
                gate.release()


class Comm:
    """What a rank gets of others it gets as copies. boards: two in turns, so that ranks meet once for each call: when
    all are at the next one, all have read this."""

    def __init__(self, rank, size, boards, meeting, mail=None):
        self.rank, self.size, self.boards, self.meeting, self.mail = rank, size, boards, meeting, mail
        self.calls, self.turn = [], 0

    def _left(self, left, name):
        """What each rank has left for the others, which must not change it."""
        self.calls.append(name)
        self.turn += 1
        board = self.boards[self.turn % 2]
        board[self.rank] = name, left
        self.meeting.wait(self.rank)
        found = list(board)
        assert {each for each, _ in found} == {name}, "ranks call different things"
        return [each for _, each in found]

    def _exchanged(self, value, name):
        return [pickle.loads(each) for each in self._left(pickle.dumps(value), name)]

    def allgather(self, value):
        return self._exchanged(value, "allgather")

    def alltoall(self, values):
        assert len(values) == self.size
        return [pickle.loads(each[self.rank]) for each in self._left([*map(pickle.dumps, values)], "alltoall")]

    def allreduce(self, value, operation=MPI.SUM):
        return combined(operation, self._exchanged(value, "allreduce"))

    def Allreduce(self, given, found, operation=MPI.SUM):
        found[:] = combined(operation, self._left(np.array(given), "Allreduce"))

    def exscan(self, value):
        before = self._exchanged(value, "exscan")[: self.rank]
        return sum(before) if before else None

    def bcast(self, value, root=0):
        return pickle.loads(self._left(pickle.dumps(value) if self.rank == root else None, "bcast")[root])

    def gather(self, value, root=0):
        left = self._left(pickle.dumps(value), "gather")
        return [pickle.loads(each) for each in left] if self.rank == root else None

    def scatter(self, values, root=0):
        left = [*map(pickle.dumps, values)] if self.rank == root else None
        return pickle.loads(self._left(left, "scatter")[root][self.rank])

    def send(self, value, dest):
        self.mail[self.rank, dest].put(pickle.dumps(value))

    def recv(self, source):
        return pickle.loads(self.mail[source, self.rank].get(timeout=120))

    def Create_dist_graph_adjacent(self, sources, destinations):
        assert list(sources) == list(destinations)
        assert self.rank not in sources
        for rank, others in enumerate(self._exchanged(list(sources), "graph")):
            assert (self.rank in others) == (rank in sources), "each is the other's neighbour"
        return Graph(self, list(sources))


class Graph:
    def __init__(self, comm, neighbours):
        self.comm, self.neighbours = comm, neighbours

    def Neighbor_alltoallv(self, sent, got):
        parts = np.split(sent[0].flatten(), np.cumsum(sent[1])[:-1])
        mine = dict(zip(self.neighbours, parts, strict=True)) if self.neighbours else {}
        every = self.comm._left(mine, "neighbours")
        came = [every[rank][self.comm.rank] for rank in self.neighbours]
        assert [part.size for part in came] == list(got[1])
        if came:
            got[0].reshape(-1)[:] = np.concatenate(came)

    def Neighbor_alltoallv_init(self, sent, got):
        return Request(self, sent, got)

    def Free(self):
        self.comm.calls.append("freed")


class Request:
    def __init__(self, graph, sent, got):
        self.graph, self.buffers = graph, (sent, got)

    def Start(self):
        self.graph.Neighbor_alltoallv(*self.buffers)

    def Wait(self):
        pass

    def Free(self):
        pass


def together(count, work):
    """What work(comm) returns on each of so many ranks; raises what the first raises that fails."""
    boards, meeting = ([None] * count, [None] * count), Meeting(count)
    mail = {(one, other): queue.SimpleQueue() for one in range(count) for other in range(count)}

    def one(rank):
        try:
            return work(Comm(rank, count, boards, meeting, mail))
        except BaseException:
            meeting.abort()
            raise

    with ThreadPoolExecutor(count) as pool:
        futures = [pool.submit(one, rank) for rank in range(count)]
    errors = [future.exception() for future in futures]
    for error in errors:
        if error is not None and not isinstance(error, threading.BrokenBarrierError):
            raise error
    return [future.result() for future in futures]
