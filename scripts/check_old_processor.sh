#!/usr/bin/env bash
# Bits of integrals, weights and cells on an emulated Nehalem (2008, no AVX), where the baseline is chosen, beside those of
# each level that this processor has: scripts/check_old_processor.sh [PYTHON]. Needs apt-get install qemu-user.
# OpenBLAS has the same kernel everywhere: by itself it chooses one by the processor, and kernels round differently.
set -euo pipefail
python=${1:-.venv/bin/python}
export OPENBLAS_CORETYPE=Nehalem OPENBLAS_NUM_THREADS=1 VOROQUAD_NUM_THREADS=1
program='
import hashlib, numpy as np, voroquad as vq
points = np.random.default_rng(1).random((200, 2))
f = lambda x: np.exp(x[0] * x[1])
for n in (128, 20_000):
    print(float(vq.quad(f, [0, 0], [1, 2], n_points=n, rng=1).integral).hex())
for found in (vq.weights(points), vq.cells(points).measures):
    print(hashlib.sha256(found.tobytes()).hexdigest()[:16])'
chosen='from voroquad._core import _chosen as c; assert c.__name__.endswith("_core_baseline"), c.__name__'
old=$(env -u VOROQUAD_PROCESSOR qemu-x86_64 -cpu Nehalem "$python" -c "$chosen$program")
levels=$("$python" -c 'from voroquad._core import installed_levels; print(*installed_levels())')
for level in $levels; do
  here=$(VOROQUAD_PROCESSOR=$level "$python" -c "$program")
  [ "$here" = "$old" ] || { echo "Nehalem differs from $level: $old, $here"; exit 1; }
done
echo "Nehalem: the same bits as $levels"
