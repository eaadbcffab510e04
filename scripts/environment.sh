# Sourced by demo and test: goes to the project's root and defines `prepare`, which makes .venv.

cd "$(dirname "${BASH_SOURCE[0]}")/.."

say() { printf '%s\n' "$*" >&2; }

# The first Python >= 3.11; the variable PYTHON names another one.
python() {
    local candidate
    for candidate in ${PYTHON:-python3 python3.13 python3.12 python3.11}; do
        if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            printf '%s' "$candidate"
            return
        fi
    done
    say "No Python >= 3.11 is found (${PYTHON:-python3}); install one, or name it: PYTHON=/path/to/python3 $0"
    return 1
}

# as_root COMMAND...: runs it as root, where that is possible without a question.
as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo -n "$@"; fi
}

# debian PACKAGE...: installs packages of the system, where there is apt and root allows it.
debian() {
    [ "$(uname)" = Linux ] && command -v apt-get >/dev/null && as_root true 2>/dev/null || return 1
    say "Installing $*"
    as_root apt-get update -q >&2
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends "$@" >&2
}

# Pictures are drawn with libGL and libEGL, open3d (extra all) needs libusb; without them everything else works.
libraries() {
    local library packages=() wanted=(libGL.so.1:libgl1 libEGL.so.1:libegl1)
    if [ "$1" = all ]; then wanted+=(libusb-1.0.so.0:libusb-1.0-0); fi
    for library in "${wanted[@]}"; do
        if ! ldconfig -p 2>/dev/null | grep -q "${library%%:*}"; then packages+=("${library##*:}"); fi
    done
    if [ "$(uname)" != Linux ] || [ ${#packages[@]} -eq 0 ] || debian "${packages[@]}"; then return; fi
    say "There will be no pictures, or no open3d: run  sudo apt-get install ${packages[*]}"
}

# Some tests open pages in a browser or load a database of their own; they are skipped where these are absent.
servers() {
    local packages=()
    if ! command -v chromium >/dev/null; then packages+=(chromium); fi
    if ! ls /usr/share/postgresql/*/extension/postgis.control >/dev/null 2>&1; then packages+=(postgresql postgis postgresql-postgis); fi
    if [ ${#packages[@]} -eq 0 ] || debian "${packages[@]}"; then return; fi
    say "Tests that need ${packages[*]} are skipped"
}

# prepare EXTRA: installs treepipe with that extra ("" for none), unless it has been done before.
prepare() {
    local extra=$1 stamp wanted
    stamp=.venv/.treepipe${extra:+-$extra}
    wanted=$(cat pyproject.toml setup.py | sha256sum)
    if [ -x .venv/bin/python ] && [ "$(cat "$stamp" 2>/dev/null)" = "$wanted" ]; then return; fi
    if [ ! -x .venv/bin/python ]; then
        local found
        found=$(python)
        say "Making .venv with $found"
        "$found" -m venv .venv
    fi
    say "Installing treepipe${extra:+ with the extra $extra} into .venv"
    .venv/bin/python -m pip install --quiet --disable-pip-version-check -e ".${extra:+[$extra]}" >&2
    libraries "$extra"
    if [ "$extra" = all ]; then servers; fi
    printf '%s\n' "$wanted" >"$stamp"
}
