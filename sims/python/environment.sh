# This file is for bash scripts: `make_environment FOLDER` creates a virtual environment with pip and replaces an
# existing one.
make_environment() {
    local venv=$1
    rm -rf "$venv"
    python3 -m venv "$venv" 2>/dev/null && return
    rm -rf "$venv"
    # Debian's Python may lack the files with which `venv` installs pip; an installed pip does it
    # then.
    if python3 -m pip --version >/dev/null 2>&1; then
        python3 -m venv --without-pip "$venv" && python3 -m pip --quiet --python "$venv/bin/python" install pip && return
    fi
    rm -rf "$venv"
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        { apt-get update && apt-get install -y --no-install-recommends python3-venv; } >/dev/null
        python3 -m venv "$venv" && return
    fi
    echo "error: cannot create a virtual environment" >&2
    echo "  help: install python3-venv (Debian: apt-get install python3-venv)" >&2
    return 1
}
export PIP_DISABLE_PIP_VERSION_CHECK=1
