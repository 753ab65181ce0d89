#!/usr/bin/env bash
# Makes what pip cannot: the shared libraries that the wheels load, and a virtual environment in folder $1; with `test`
# as $2 also a browser, in which the tests of pages run.
# Installs Debian packages only when some are missing and it may. Otherwise it names the libraries and stops; without a
# browser it goes on, and those tests are skipped.
set -euo pipefail
venv=$1
extra=${2:-}

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

# Why no packages can be installed; nothing if they can.
hindrance() {
    if ! command -v apt-get >/dev/null; then
        echo "there is no apt-get"
    elif [ "$(id -u)" -ne 0 ] && ! sudo -n true 2>/dev/null; then
        echo "this user may not run apt-get as root"
    fi
}

install_packages() {
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        as_root=(sudo -n)
    fi
    echo "installing the system packages $*" >&2
    "${as_root[@]}" apt-get update -qq &&
        "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

# Whether a browser is installed that runs; the names are those of tests/browser.py. What Ubuntu calls chromium-browser
# may only say that it is a snap.
has_browser() {
    local name
    for name in chromium chromium-browser google-chrome google-chrome-stable chrome; do
        if command -v "$name" >/dev/null && timeout 60 "$name" --version >/dev/null 2>&1; then
            return 0
        fi
    done
    return 1
}

provide_browser() {
    local reason
    if has_browser; then
        return
    fi
    reason=$(hindrance)
    if [ -z "$reason" ] && apt-cache depends chromium 2>/dev/null | grep -q snapd; then
        reason="the package chromium is a snap here"
    fi
    if [ -z "$reason" ]; then
        if install_packages chromium && has_browser; then
            return
        fi
        reason="apt-get gave no chromium that runs"
    fi
    echo "no browser runs here ($reason), so the tests of pages are skipped; Debian's package chromium has one" >&2
}

python=$(find_python)
missing=($(missing_libraries))
if [ ! -x "$venv/bin/python" ] && ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    missing+=("$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')")
fi
if [ "${#missing[@]}" -gt 0 ]; then
    reason=$(hindrance)
    if [ -n "$reason" ]; then
        echo "these system packages (Debian's names) are missing, and $reason: ${missing[*]}; install them and try again" >&2
        exit 1
    fi
    install_packages "${missing[@]}"
fi
if [ "$extra" = test ]; then
    provide_browser
fi
if [ ! -x "$venv/bin/python" ]; then
    "$python" -m venv "$venv"
fi
