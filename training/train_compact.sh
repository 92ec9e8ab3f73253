#!/bin/sh
# Pairs, baseline, training and export in one go; what exists and is whole is kept, so it can be started again.
#
#   sh train_compact.sh DATA RUN MINUTES OUT.safetensors [flags for the training]
#
# DATA holds features-train, features-val (bouncelight dataset) and cycles-train, cycles-val (cycles/paper_rooms.py).
set -eu
data=$1 run=$2 minutes=$3 out=$4
shift 4
python=${PYTHON:-python}
here=$(cd "$(dirname "$0")" && pwd)
export PYTHONPATH="$here${PYTHONPATH:+:$PYTHONPATH}"
mkdir -p "$run" "$(dirname "$out")"
for split in train val; do
    [ -e "$data/$split.npz" ] || "$python" -m bouncelight_training.data --features "$data/features-$split" --cycles "$data/cycles-$split" --out "$data/$split.npz"
done
"$python" -m bouncelight_training.baseline --train "$data/train.npz" --validation "$data/val.npz" --json "$run/baseline.json"
"$python" -m bouncelight_training.train --train "$data/train.npz" --validation "$data/val.npz" --run "$run" --minutes "$minutes" "$@"
"$python" -m bouncelight_training.export --run "$run" --out "$out" --validation "$data/val.npz"
