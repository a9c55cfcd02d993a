"""One deviation of one file of float64 readings by allantools, timed: `peers.py KIND FILE`.

Prints `seconds S`, `peak_kib K` and one line `dev M SIGMA` for each cluster time.
"""

import sys
import time

import allantools
import numpy

kind, path = sys.argv[1:3]
readings = numpy.fromfile(path, dtype=numpy.float64)
begun = time.perf_counter()
taus, deviations, _, _ = getattr(allantools, kind)(readings, rate=1.0, data_type="freq", taus="octave")
print("seconds", time.perf_counter() - begun)
with open("/proc/self/status") as status:
    for line in status:
        if line.startswith("VmHWM"):
            print("peak_kib", line.split()[1])
for tau, deviation in zip(taus, deviations):
    print("dev", round(tau), repr(float(deviation)))
