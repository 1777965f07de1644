"""FMUs in processes of their own: what crashes, hangs or changes its process there does not reach this one.

Read `stand_in.py` first, then `channel.h`: in the place of an FMU's binary stands a library of ours with the same
functions, which asks a host process for each call through shared memory. No caller of an instance notices.
"""
