#!/bin/sh
# Builds and installs the peers that the benchmarks compare with. Nothing leaves the folder given.
#   tests/benches/peers/install.sh [--pinocchio] [--drake] [--mujoco] [--exudyn] [--basilisk] [folder, default target/peers]
# Without an option: Pinocchio, with coal for shapes. Python packages go into a virtual environment in the folder.
# The headers of Pinocchio, coal and Eigen come from PyPI; clang compiles the templates, since that is
# Pinocchio's fastest build.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
dir=target/peers
want=
for word in "$@"; do
    case $word in
    --pinocchio | --drake | --mujoco | --exudyn | --basilisk) want="$want $word" ;;
    -*)
        echo "error: unknown option $word: --pinocchio, --drake, --mujoco, --exudyn, --basilisk" >&2
        exit 1
        ;;
    *) dir=$word ;;
    esac
done
[ -n "$want" ] || want=" --pinocchio"
mkdir -p "$dir"
dir=$(cd "$dir" && pwd)
[ -x "$dir/venv/bin/pip" ] || python3 -m venv "$dir/venv"

python_peer() {
    "$dir/venv/bin/pip" install --quiet "$1"
    echo "installed: $1"
    echo "run:   LINKWORK_PEERS=$dir cargo bench -p linkwork-tests --bench wiring"
}

pinocchio() {
    cxx=${CXX:-clang++}
    if ! command -v "$cxx" >/dev/null 2>&1; then
        echo "error: no $cxx: install it (Debian, Ubuntu: apt-get install clang) or set CXX" >&2
        exit 1
    fi
    "$dir/venv/bin/pip" install --quiet 'pin>=4.1,<5' 'coal>=3,<4' cmeel-eigen
    prefix=$("$dir/venv/bin/python" -c \
        'import sysconfig, os; print(os.path.join(sysconfig.get_paths()["purelib"], "cmeel.prefix"))')
    # There are two builds: the best for this processor, and one for the instructions that Linkwork
    # is built for.
    best=
    for arch in native x86-64-v3; do
        case $(uname -m)-$arch in x86_64-* | *-native) ;; *) continue ;; esac
        "$cxx" -std=c++17 -O3 -DNDEBUG -march=$arch -Wno-deprecated-declarations \
            -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS \
            -DBOOST_FUSION_INVOKE_MAX_ARITY=12 \
            -I"$prefix/include" -I"$prefix/include/eigen3" \
            -S "$here/pinocchio_bench.cpp" -o "$dir/pinocchio_bench.s"
        # callgrind counts the second build: valgrind 3.19 does not know the short form of vmovq
        # between two registers. The long form does the same.
        long=
        [ $arch = native ] || long='s/^\tvmovq\t\(%xmm[0-9]*, %xmm\)/\t{vex3} vmovq\t\1/'
        sed "$long" "$dir/pinocchio_bench.s" >"$dir/pinocchio_bench_long.s"
        "$cxx" "$dir/pinocchio_bench_long.s" -o "$dir/pinocchio_bench_$arch"
        rm "$dir/pinocchio_bench.s" "$dir/pinocchio_bench_long.s"
        best="$best $dir/pinocchio_bench_$arch"
    done
    echo "built:$best"
    echo "run:   LINKWORK_PINOCCHIO_BENCH=$dir/pinocchio_bench_native cargo bench -p linkwork-dynamics"
    "$cxx" -std=c++17 -O3 -DNDEBUG -march=native -Wno-deprecated-declarations \
        -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS \
        -DBOOST_FUSION_INVOKE_MAX_ARITY=12 \
        -I"$prefix/include" -I"$prefix/include/eigen3" \
        "$here/pinocchio_constrained.cpp" -o "$dir/pinocchio_constrained"
    echo "built: $dir/pinocchio_constrained"
    echo "run:   LINKWORK_PINOCCHIO_CONSTRAINED=$dir/pinocchio_constrained cargo bench -p linkwork-solvers --bench constrained"
    # libcoal is built for any x86-64 processor and expects its arguments with that alignment, so there is no
    # -march.
    "$cxx" -std=c++17 -O3 -DNDEBUG -Wno-deprecated-declarations \
        -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS \
        -DBOOST_FUSION_INVOKE_MAX_ARITY=12 \
        -I"$prefix/include" -I"$prefix/include/eigen3" \
        "$here/robot_queries.cpp" -o "$dir/robot_queries" \
        -L"$prefix/lib" -lcoal -Wl,-rpath,"$prefix/lib" -Wl,-rpath-link,"$prefix/lib"
    echo "built: $dir/robot_queries"
    echo "run:   LINKWORK_ROBOT_QUERIES=$dir/robot_queries cargo bench -p linkwork-embedded --bench collide --bench hold"
    clik
}

# The inverse kinematics by Levenberg and Marquardt on Pinocchio is a program of the reference data, which are next to
# the project.
clik() {
    definitions=$here/../../../../shared/reference/robodarts/bench
    if [ ! -f "$definitions/clik.cpp" ]; then
        echo "no reference data beside the project: inverse kinematics has no peer"
        return
    fi
    mkdir -p "$dir/clik"
    cp "$definitions"/*.chain "$dir/clik"
    "$cxx" -std=c++17 -O3 -DNDEBUG -march=native -Wno-deprecated-declarations \
        -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS \
        -DBOOST_FUSION_INVOKE_MAX_ARITY=12 \
        -I"$prefix/include" -I"$prefix/include/eigen3" "$definitions/clik.cpp" -o "$dir/clik/clik"
    echo "built: $dir/clik/clik"
    echo "run:   LINKWORK_CLIK=$dir/clik/clik cargo bench -p linkwork-embedded --bench reach"
}

mujoco() {
    cc=${CC:-cc}
    python_peer 'mujoco>=3'
    package=$("$dir/venv/bin/python" -c 'import mujoco, os; print(os.path.dirname(mujoco.__file__))')
    "$cc" -O3 -DNDEBUG -I"$package/include" "$here/mujoco_steps.c" "$package"/libmujoco.so.* \
        -Wl,-rpath,"$package" -lm -o "$dir/mujoco_steps"
    echo "built: $dir/mujoco_steps"
    echo "run:   LINKWORK_MUJOCO_STEPS=$dir/mujoco_steps cargo bench -p linkwork-solvers --bench stepping"
}

for peer in $want; do
    case $peer in
    --pinocchio) pinocchio ;;
    --drake) python_peer 'drake>=1.51,<2' ;;
    --mujoco) mujoco ;;
    --exudyn) python_peer 'exudyn>=1.9,<2' ;;
    --basilisk)
        python_peer 'bsk>=2.12,<3'
        echo "run:   LINKWORK_BASILISK_PYTHON=$dir/venv/bin/python cargo bench -p linkwork-tests --bench space"
        ;;
    esac
done
