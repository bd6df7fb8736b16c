"""A vehicle that is not there: it speaks as PX4 or ArduPilot does, and flies what is predicted.

Each protocol is a small state machine without a line or a clock of its own: it is fed messages and
times.  So faults and virtual time are testable, and one vehicle serves sockets and memory alike.
"""
