# Sourced by the scripts beside it: makes sure that .venv holds exactly what the locks say, then sets PYTHON.
#
# A script that needs more than evoexp itself sets lock=requirements-test.lock first. The environment is built anew when
# a lock or the checkout's place changes; where only the project's own metadata changed (entry points, say), evoexp alone
# is installed again. With uv, which is several times faster than pip: the one that is installed, or the one that
# requirements-uv.lock names, which pip fetches from where it is set up to look; with pip alone where that cannot be had.
# Nothing but Python >= 3.11 is needed beforehand.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
venv="$root/.venv"
PYTHON="$venv/bin/python"
lock=${lock:-requirements.lock}

# One mark per lock and one for evoexp itself, each written when it is installed: an interrupted step is done again.
marks="$venv/.installed"
mark_of() {
  case $1 in
    evoexp) { echo "$root" && sed '/^\[tool/,$d' "$root/pyproject.toml"; } | cksum ;;  # settings of tools have no part
    *) { echo "$root" && cat "$root/$1"; } | cksum ;;
  esac
}
is_installed() { [ "$(cat "$marks/$1" 2>/dev/null)" = "$(mark_of "$1")" ]; }
was_installed() { [ -e "$marks/$1" ]; }
note_installed() { mark_of "$1" >"$marks/$1"; }

is_complete() {
  [ -x "$PYTHON" ] && is_installed requirements.lock && is_installed "$lock" && is_installed evoexp
}

find_python() {  # never that of a virtual environment: it might be the one that is rebuilt
  local candidate
  for candidate in "${EVOEXP_PYTHON:-}" python3 python3.13 python3.12 python3.11; do
    if [ -n "$candidate" ] && command -v "$candidate" >/dev/null 2>&1 && "$candidate" -c \
      'import sys; (3, 11) <= sys.version_info[:2] <= (3, 13) or sys.exit(1); print(sys._base_executable)' 2>/dev/null; then
      return
    fi
  done
  echo "evoexp: needs Python 3.11, 3.12 or 3.13 on PATH (or its path in EVOEXP_PYTHON)" >&2
  return 1
}

find_pip() {  # that of the environment, or the wheel that comes with Python: an environment without pip is made faster
  if "$PYTHON" -c 'import pip' 2>/dev/null; then
    pip=("$PYTHON" -m pip)
  else
    pip=("$PYTHON" "$("$PYTHON" -c \
      'import ensurepip, pathlib; print(*sorted(pathlib.Path(ensurepip.__file__).parent.glob("_bundled/pip-*.whl"))[-1:])')/pip")
    [ -e "${pip[1]%/pip}" ] || { "$PYTHON" -m ensurepip >/dev/null && pip=("$PYTHON" -m pip); }
  fi
}

# pip's settings as uv's: whoever told pip where packages are, and how to get there, need not tell uv.
settings_for_uv='
import ast, os, shlex, sys
found = {}
lines = [line.partition("=")[::2] for line in sys.stdin.read().splitlines() if "=" in line]
for section in ("global", "install", ":env:"):  # the later ones count more
    for key, value in lines:
        if key.rpartition(".")[0] == section:
            found[key.rpartition(".")[2]] = str(ast.literal_eval(value)).split()
names = {"index-url": "UV_DEFAULT_INDEX", "extra-index-url": "UV_INDEX", "find-links": "UV_FIND_LINKS",
         "cert": "SSL_CERT_FILE", "client-cert": "SSL_CLIENT_CERT", "timeout": "UV_HTTP_TIMEOUT",
         "trusted-host": "UV_INSECURE_HOST", "proxy": "ALL_PROXY"}
given = {names[key]: ("," if key == "find-links" else " ").join(words) for key, words in found.items() if key in names}
if found.get("no-index", ["0"])[0].lower() in ("1", "true", "yes", "on"):
    given["UV_NO_INDEX"] = "1"
given["UV_INDEX_STRATEGY"] = "unsafe-best-match"  # as pip: all places count alike, the hashes decide
for name, value in given.items():
    if not os.environ.get(name) and not (name == "UV_DEFAULT_INDEX" and os.environ.get("UV_INDEX_URL")):
        print(f"export {name}={shlex.quote(value)}")
'

find_uv() {  # sets uv and its settings, if there is one
  uv=$(command -v uv || true)
  if [ -z "$uv" ] && [ ! -x "$venv/bin/uv" ] && [ "${#pip[@]}" -gt 0 ]; then
    "${pip[@]}" install --quiet --disable-pip-version-check --require-hashes --no-deps --only-binary :all: \
      -r "$root/requirements-uv.lock" >/dev/null 2>&1 || rm -f "$venv/bin/uv"
  fi
  [ -n "$uv" ] || [ ! -x "$venv/bin/uv" ] || uv="$venv/bin/uv"
  if [ -n "$uv" ] && [ "${#pip[@]}" -gt 0 ]; then
    uv_settings=$("${pip[@]}" --disable-pip-version-check config list 2>/dev/null | "$PYTHON" -c "$settings_for_uv" || true)
  fi
}

with_uv() {  # whatever fails is tried again with pip, which says what is wrong
  # Bytecode ahead of use only where Python may not write it on first use; every start would take seconds longer.
  (
    eval "$uv_settings"
    exec "$uv" pip install --quiet ${PYTHONDONTWRITEBYTECODE:+--compile-bytecode} --python "$PYTHON" "$@" 2>/dev/null
  ) || with_pip "$@"
}

with_pip() {
  "$PYTHON" -m pip --version >/dev/null 2>&1 || "$PYTHON" -m ensurepip >/dev/null || return
  local bytecode=--no-compile  # as with uv
  [ -z "${PYTHONDONTWRITEBYTECODE-}" ] || bytecode=--compile
  "$PYTHON" -m pip install --quiet --disable-pip-version-check "$bytecode" "$@"
}

choose_tool() {
  pip=() uv="" uv_settings=""
  find_pip 2>/dev/null || pip=()
  find_uv
  tool=with_pip
  [ -z "$uv" ] || tool=with_uv
}

create() {
  local base
  base=$(find_python) || return
  rm -rf "$venv"
  echo "evoexp: creating $venv (once; about a minute, some minutes where uv cannot be had)" >&2
  "$base" -m venv --without-pip "$venv" || return
  mkdir -p "$marks"
}

install_lock() {  # $1: name of the lock
  # The build tools first: one dependency exists only as a source archive, and its build must not fetch others.
  awk '/^[^ ]/ { wanted = /^(packaging|setuptools|wheel)==/ } wanted' "$root/$1" >"$venv/build.lock" &&
    "$tool" --require-hashes --no-deps -r "$venv/build.lock" &&
    "$tool" --require-hashes --no-build-isolation -r "$root/$1" &&
    note_installed "$1"
}

install() {
  local tool one pip uv uv_settings
  exec 9<"$root/requirements.lock" || return
  "$(find_python)" -c 'import fcntl; fcntl.flock(9, fcntl.LOCK_EX)' || return  # one process at a time; freed at its end
  is_complete && return
  for one in requirements.lock requirements-test.lock requirements-docs.lock; do  # a lock that changed: what it no longer names shall go
    if was_installed "$one" && ! is_installed "$one"; then rm -rf "$marks"; fi
  done
  { [ -x "$PYTHON" ] && [ -d "$marks" ]; } || create || return
  choose_tool
  is_installed requirements.lock || install_lock requirements.lock || return
  is_installed "$lock" || install_lock "$lock" || return
  is_installed evoexp || { "$tool" --no-deps --no-build-isolation -e "$root" && note_installed evoexp; }
}

if ! is_complete; then
  if ! install >&2; then
    echo "evoexp: the environment could not be installed (see above)" >&2
    exit 2
  fi
  exec 9<&-
fi
