# Sourced by the scripts beside it: makes sure that .venv holds exactly what the locks say, then sets PYTHON.
#
# A script that needs more than evoexp itself sets lock=requirements-test.lock first. The environment is built anew when
# a lock or the checkout's place changes; where only the project's own metadata changed (entry points, say), evoexp alone
# is installed again. With uv, which is several times faster than pip and is locked, too; with pip where uv cannot be had
# or fails. Nothing but Python >= 3.11 is needed beforehand.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
venv="$root/.venv"
PYTHON="$venv/bin/python"
lock=${lock:-requirements.lock}

# One mark per lock and one for evoexp itself, each written when it is installed: an interrupted step is done again.
marks="$venv/.installed"
mark_of() {
  case $1 in
    evoexp) { echo "$root" && sed '/^\[tool/,$d' "$root/pyproject.toml" && cat "$root/src/evoexp/version.py"; } | cksum ;;  # settings of tools have no part
    *) { echo "$root" && cat "$root/$1"; } | cksum ;;
  esac
}
is_installed() { [ "$(cat "$marks/$1" 2>/dev/null)" = "$(mark_of "$1")" ]; }
note_installed() { mark_of "$1" >"$marks/$1"; }

is_complete() {
  [ -x "$PYTHON" ] && is_installed requirements.lock && is_installed "$lock" && is_installed evoexp
}

find_python() {  # never that of a virtual environment: it might be the one that is rebuilt
  local candidate
  for candidate in "${EVOEXP_PYTHON:-}" python3 python3.14 python3.13 python3.12 python3.11; do
    if [ -n "$candidate" ] && command -v "$candidate" >/dev/null 2>&1 && "$candidate" -c \
      'import sys; (3, 11) <= sys.version_info[:2] <= (3, 14) or sys.exit(1); print(sys._base_executable)' 2>/dev/null; then
      return
    fi
  done
  echo "evoexp: needs Python 3.11, 3.12, 3.13 or 3.14 on PATH (or its path in EVOEXP_PYTHON)" >&2
  return 1
}

create() {
  local base
  base=$(find_python) || return
  rm -rf "$venv"
  echo "evoexp: creating $venv (once; about a minute, some minutes where uv cannot be had)" >&2
  # some distributions pack Python without pip: then uv on PATH has to do
  "$base" -m venv "$venv" >/dev/null 2>&1 || "$base" -m venv --without-pip "$venv" || return
  mkdir -p "$marks"
}

locked() {  # the entries of a lock for some distributions: $1 its name, $2 their names, as a|b
  awk -v names="^($2)==" '/^[^ ]/ { wanted = $0 ~ names } wanted' "$root/$1"
}

install_with() {  # $1: uv or pip; the rest: what and how
  case $1 in
    uv) "$uv" pip install --quiet ${PYTHONDONTWRITEBYTECODE:+--compile-bytecode} --python "$PYTHON" "${@:2}" 2>/dev/null ;;
    pip) "$PYTHON" -m pip install --quiet --disable-pip-version-check "${@:2}" ;;
  esac
}

get() { { [ -n "$uv" ] && install_with uv "$@"; } || install_with pip "$@"; }  # pip says what is wrong

install_lock() {  # $1: name of the lock
  # The build tools first: one dependency exists only as a source archive, and its build must not fetch others.
  locked "$1" "packaging|setuptools|wheel" >"$venv/build.lock" &&
    get --require-hashes --no-deps -r "$venv/build.lock" &&
    get --require-hashes --no-build-isolation -r "$root/$1" &&
    note_installed "$1"
}

install() {
  local one uv
  exec 9<"$root/requirements.lock" || return
  "$(find_python)" -c 'import fcntl; fcntl.flock(9, fcntl.LOCK_EX)' || return  # one process at a time; freed at its end
  is_complete && return
  for one in requirements.lock requirements-test.lock; do  # a lock that changed: what it no longer names shall go
    if [ -e "$marks/$one" ] && ! is_installed "$one"; then rm -rf "$marks"; fi
  done
  { [ -x "$PYTHON" ] && [ -d "$marks" ]; } || create || return
  if ! uv=$(command -v uv || command -v "$venv/bin/uv"); then
    locked requirements.lock uv >"$venv/uv.lock"
    install_with pip --require-hashes -r "$venv/uv.lock" 2>/dev/null && uv="$venv/bin/uv"
  fi
  is_installed requirements.lock || install_lock requirements.lock || return
  is_installed "$lock" || install_lock "$lock" || return
  is_installed evoexp || { get --no-deps --no-build-isolation -e "$root" && note_installed evoexp; }
}

if ! is_complete; then
  if ! install >&2; then
    echo "evoexp: the environment could not be installed (see above)" >&2
    exit 2
  fi
  exec 9<&-
fi
