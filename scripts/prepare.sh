#!/usr/bin/env bash
# Makes what pip cannot: the shared libraries that the wheels load, and a virtual environment in folder $1.
# Installs Debian packages only when some are missing and it may; otherwise it names them and stops.
set -euo pipefail
venv=$1

find_python() {
    local name
    for name in python3.11 python3.12 python3.13 python3; do
        if "$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            echo "$name"
            return
        fi
    done
    echo "structagent needs Python 3.11 or later; none of python3.11, python3.12, python3.13, python3 is one" >&2
    exit 1
}

# The Debian packages of those shared libraries that the loader does not find.
missing_libraries() {
    local known pair
    known=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p)
    for pair in libstdc++.so.6=libstdc++6 libgomp.so.1=libgomp1 libusb-1.0.so.0=libusb-1.0-0 \
        libGL.so.1=libgl1 libEGL.so.1=libegl1 libX11.so.6=libx11-6; do
        grep -qF "${pair%%=*} " <<<"$known" || echo "${pair##*=}"
    done
}

install_packages() {
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        if ! sudo -n true 2>/dev/null; then
            echo "these system packages are missing: $*; install them (apt-get install $*) and try again" >&2
            exit 1
        fi
        as_root=(sudo -n)
    fi
    if ! command -v apt-get >/dev/null; then
        echo "these system packages (Debian's names) are missing, and there is no apt-get: $*" >&2
        exit 1
    fi
    echo "installing the system packages $*" >&2
    "${as_root[@]}" apt-get update -qq
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

python=$(find_python)
missing=($(missing_libraries))
if [ ! -x "$venv/bin/python" ] && ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    missing+=("$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')")
fi
if [ "${#missing[@]}" -gt 0 ]; then
    install_packages "${missing[@]}"
fi
if [ ! -x "$venv/bin/python" ]; then
    "$python" -m venv "$venv"
fi
