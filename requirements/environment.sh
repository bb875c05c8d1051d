#!/bin/sh
# Makes .venv with the locked packages and this checkout in it, or leaves it alone when it is up to date.
# Called by make; needs a POSIX shell, coreutils and Python 3.11 or newer. PYTHON=/path/to/python chooses one.
# With the argument "study" only what a study needs is installed; without, everything, which holds that too.
set -eu
cd "$(dirname "$0")/.."

venv=.venv
stamp=$venv/nlsdesign.stamp
if [ "${1:-}" = study ]; then
    lock=requirements/study.txt size='320 MB to download, 1.2 GB on disk'
else
    lock=requirements/locked.txt size='400 MB to download, 1.6 GB on disk'
fi
forms='The same without make (from the folder of the checkout):
  with pip:  python3 -m venv .venv && .venv/bin/python -m pip install -e ".[export,test,lint]"
  with uv:   uv venv --python 3.11 && uv pip install -e ".[export,test,lint]"
             (uv brings its own Python; it needs neither python3 nor python3-venv)'

say() { printf '%s\n' "nlsdesign: $*" >&2; }

# An environment knows where it stands, so the folder counts as well as what is to be installed.
fingerprint() { pwd -P && cksum pyproject.toml requirements/*.txt requirements/environment.sh && echo "$1"; }

# Whether the environment holds what the given list of packages names.
holds() { [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$(fingerprint "$1")" ]; }

works() { [ -x "$venv/bin/python" ] && "$venv/bin/python" -m pip --version >/dev/null 2>&1; }

# Sets $python to the first suitable of the names given; explains and ends the run when there is none.
find_python() {
    probe='import sys, importlib.util as u
print("%d.%d" % sys.version_info[:2], "old" if sys.version_info < (3, 11) else
      "ready" if u.find_spec("venv") and u.find_spec("ensurepip") else "no-venv")'
    old='' bare=''
    if [ -n "${PYTHON:-}" ]; then set -- "$PYTHON"; fi
    for python in "$@"; do
        found=$("$python" -c "$probe" 2>/dev/null) || continue
        case $found in
            *' ready') return 0 ;;
            *' no-venv') bare=${bare:-${found% *}} ;;
            *' old') old="$old $python is ${found% *}." ;;
        esac
    done
    if [ -n "$bare" ]; then
        say "Python $bare is there, but its part that makes virtual environments is not."
        say "On Debian and Ubuntu:  sudo apt install python$bare-venv   then run make again."
    elif [ -n "${PYTHON:-}" ]; then
        say "PYTHON=$PYTHON is not Python 3.11 or newer.$old"
        say "Give the path of one, or leave PYTHON away to search PATH."
    else
        say "no Python 3.11 or newer was found on PATH.$old"
        say "Debian 12, Ubuntu 24.04 or newer:  sudo apt install python3 python3-venv"
        say "Fedora:  sudo dnf install python3      macOS with Homebrew:  brew install python"
        say "Then run make again; an interpreter elsewhere:  make PYTHON=/path/to/python ..."
    fi
    printf '%s\n' "$forms" >&2
    exit 2
}

if { holds "$lock" || holds requirements/locked.txt; } && works; then
    exit 0
fi

# Settings of the user's own pip that cannot work inside an environment.
export PIP_USER=0 PIP_REQUIRE_VIRTUALENV=0 PIP_DISABLE_PIP_VERSION_CHECK=1
quiet=--quiet
[ ! -t 1 ] || quiet=

# A moved checkout leaves an environment whose commands point at the old place: made anew, like a broken one.
if ! works || [ "$(head -n 1 "$stamp" 2>/dev/null)" != "$(pwd -P)" ]; then
    find_python python3 python3.13 python3.12 python3.11 python3.14 python3.15 python
    say "making .venv with Python ${found% *} ..."
    "$python" -m venv --clear "$venv" || {
        say "'$python -m venv .venv' failed; the reason stands above."
        printf '%s\n' "$forms" >&2
        exit 2
    }
fi
rm -f "$stamp"

say "installing the locked packages (once; $size) ..."
# uv unpacks on all cores. Where it finds nothing, as behind a mirror of which only pip knows, pip does it: half of
# the list each at the same time, for most of it is unpacking; whatever one half needs stands in the other.
# Not compiled here: what is imported is compiled then, and most of it never is.
with_pip() { "$venv/bin/python" -m pip install "$@" --no-compile --no-deps --require-hashes --only-binary :all:; }
with_uv() {
    awk '/^[^ #]/ { mine = /^uv==/ } mine' "$lock" > "$venv/uv.txt"
    with_pip --quiet -r "$venv/uv.txt" || return 1
    index=${PIP_INDEX_URL:-$("$venv/bin/python" -m pip config get global.index-url 2>/dev/null || true)}
    UV_HTTP_TIMEOUT=${UV_HTTP_TIMEOUT:-20} UV_DEFAULT_INDEX=${UV_DEFAULT_INDEX:-${index:-https://pypi.org/simple}} \
        "$venv/bin/uv" pip install --quiet --python "$venv/bin/python" --no-deps --require-hashes \
        --only-binary :all: -r "$lock"
}
with_halves() {
    awk -v half="$venv/half" '/^[^ #]/ { odd = n++ % 2 } { print > (half (odd ? 1 : 0) ".txt") }' "$lock"
    with_pip --quiet -r "$venv/half0.txt" &
    beside=$!
    trap 'kill "$beside" 2>/dev/null' INT TERM
    failed=''
    # shellcheck disable=SC2086
    with_pip $quiet -r "$venv/half1.txt" || failed=1
    wait "$beside" || failed=1
    trap - INT TERM
    [ -z "$failed" ]
}
with_uv >"$venv/uv.log" 2>&1 || with_halves || {
    say "the locked packages could not be installed; the reason stands above. Is there a network, a proxy to set?"
    say "With a Python that is newer than the lock, try an older one:  make PYTHON=python3.13 ..."
    exit 2
}
rm -f "$venv"/half?.txt "$venv"/uv.txt "$venv"/uv.log
# The build backend is in the lock, so this step needs no network.
"$venv/bin/python" -m pip install $quiet --no-deps --no-build-isolation --no-index --editable . || {
    say "the packages are there, but nlsdesign itself could not be installed; the reason stands above."
    exit 2
}
fingerprint "$lock" >"$stamp"
say "ready."
