"""A communicator of several ranks, with threads in their place: as much of mpi4py's as gmsnet.distributed uses."""

from __future__ import annotations

import pickle
import queue
import threading
from concurrent.futures import ThreadPoolExecutor

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


class Comm:
    """What a rank gets of others it gets as copies."""

    def __init__(self, rank, size, board, meeting, mail=None):
        self.rank, self.size, self.board, self.meeting, self.mail = rank, size, board, meeting, mail
        self.calls = []

    def _exchanged(self, value, name):
        self.calls.append(name)
        self.board[self.rank] = pickle.dumps((name, value))
        self.meeting.wait()
        found = [pickle.loads(each) for each in self.board]
        self.meeting.wait()
        assert {each for each, _ in found} == {name}, "ranks call different things"
        return [each for _, each in found]

    def allgather(self, value):
        return self._exchanged(value, "allgather")

    def alltoall(self, values):
        assert len(values) == self.size
        return [each[self.rank] for each in self._exchanged(values, "alltoall")]

    def allreduce(self, value, operation=MPI.SUM):
        return combined(operation, self._exchanged(value, "allreduce"))

    def Allreduce(self, given, found, operation=MPI.SUM):
        found[:] = combined(operation, self._exchanged(given, "Allreduce"))

    def exscan(self, value):
        before = self._exchanged(value, "exscan")[: self.rank]
        return sum(before) if before else None

    def bcast(self, value, root=0):
        return self._exchanged(value, "bcast")[root]

    def gather(self, value, root=0):
        found = self._exchanged(value, "gather")
        return found if self.rank == root else None

    def scatter(self, values, root=0):
        return self._exchanged(values, "scatter")[root][self.rank]

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
        parts = np.split(sent[0].ravel(), np.cumsum(sent[1])[:-1])
        mine = dict(zip(self.neighbours, parts, strict=True)) if self.neighbours else {}
        every = self.comm._exchanged(mine, "neighbours")
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
    board, meeting = [None] * count, threading.Barrier(count, timeout=120)
    mail = {(one, other): queue.SimpleQueue() for one in range(count) for other in range(count)}

    def one(rank):
        try:
            return work(Comm(rank, count, board, meeting, mail))
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
