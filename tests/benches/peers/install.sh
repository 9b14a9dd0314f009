#!/bin/sh
# Builds the peers' benchmark programs. Nothing is installed outside the directory given.
#   tests/benches/peers/install.sh [directory, default target/peers]
# The headers of Pinocchio and Eigen come from PyPI into a virtual environment there; clang
# compiles the templates, since that is Pinocchio's fastest build.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
dir=${1:-target/peers}
cxx=${CXX:-clang++}
if ! command -v "$cxx" >/dev/null 2>&1; then
    echo "error: no $cxx: install it (Debian, Ubuntu: apt-get install clang) or set CXX" >&2
    exit 1
fi
mkdir -p "$dir"
dir=$(cd "$dir" && pwd)
[ -x "$dir/venv/bin/pip" ] || python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet 'pin>=4.1,<5' cmeel-eigen
prefix=$("$dir/venv/bin/python" -c \
    'import sysconfig, os; print(os.path.join(sysconfig.get_paths()["purelib"], "cmeel.prefix"))')
#: the alignment with which the URDF parser's library was compiled.
best=
for arch in native x86-64-v3; do
    case $(uname -m)-$arch in x86_64-* | *-native) ;; *) continue ;; esac
    "$cxx" -std=c++17 -O3 -DNDEBUG -march=$arch \
        -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS \
        -DBOOST_FUSION_INVOKE_MAX_ARITY=12 \
        -I"$prefix/include" -I"$prefix/include/eigen3" \
        "$here/pinocchio_bench.cpp" -o "$dir/pinocchio_bench_$arch"
    best="$best $dir/pinocchio_bench_$arch"
done
echo "built:$best"
echo "run:   LINKWORK_PINOCCHIO_BENCH=$dir/pinocchio_bench_native cargo bench -p linkwork-dynamics"
