#!/usr/bin/env bash
# A plain `pip install` of the wheel into an environment of its own: how large it is, how long the first result takes, and
# whether registering, a small table and the readers work without any of the extras. Run by `make light`, from the root.
set -euo pipefail
folder=${1:?a folder for the environment}
most_mb=350
most_seconds=60
# With a checkout on it, pip would take the wheel for installed already.
unset PYTHONPATH

rm -rf build/lib "$folder" && mkdir -p "$folder"
"${PYTHON:-python3}" -m venv "$folder/env"
bin=$PWD/$folder/env/bin
"$bin/pip" wheel --quiet --no-deps --wheel-dir "$folder" .

start=$SECONDS
"$bin/pip" install --quiet "$folder"/hybridreg-*.whl
installed=$((SECONDS - start))
cp -r hybridreg/data/demo "$folder/pair"
cd "$folder"
"$bin/hybridreg" register pair/source.npz pair/target.npz --out first
seconds=$((SECONDS - start))
mb=$(du -sm env | cut -f1)
echo "light install: $mb MB (at most $most_mb), $installed s; first result after $seconds s (at most $most_seconds)"
[ "$mb" -le "$most_mb" ]
[ "$seconds" -le "$most_seconds" ]
for heavy in torch open3d sklearn cv2 plotly matplotlib kiss_matcher; do
    if "$bin/python" -c "import $heavy" 2>/dev/null; then
        echo "$heavy is part of a light install" >&2
        exit 1
    fi
done

mkdir -p pairs/demo && cp pair/* pairs/demo && rm pairs/demo/image.jpg
"$bin/hybridreg" table classical --data pairs --starts 0 --out table
"$bin/hybridreg" --version
cd - >/dev/null
# The tests of the checkout against the installed wheel.
"$bin/pip" install --quiet "pytest>=8" "pytest-timeout>=2" "hypothesis>=6.100"
"$bin/pytest" -q -o pythonpath= -p no:cacheprovider tests/io tests/test_gate.py
