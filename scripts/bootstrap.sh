# Sourced by the scripts beside it: makes sure that .venv holds exactly what requirements.lock says, then sets PYTHON.
#
# Rebuilt when the lock, the project's metadata or the checkout's place change; with uv where it is installed (several
# times faster), with pip otherwise. Nothing but Python >= 3.11 is needed beforehand.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd -P)
venv="$root/.venv"
PYTHON="$venv/bin/python"

# Written last, so that an environment with it is complete. Settings of tools, the end of pyproject.toml, have no part.
fingerprint=$({ echo "$root" && cat "$root/requirements.lock" && sed '/^\[tool/,$d' "$root/pyproject.toml"; } | cksum)

is_complete() {
  [ -x "$PYTHON" ] && [ "$(cat "$venv/.fingerprint" 2>/dev/null)" = "$fingerprint" ]
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

install() {
  local base tool
  base=$(find_python) || return
  exec 9<"$root/requirements.lock" || return
  "$base" -c 'import fcntl; fcntl.flock(9, fcntl.LOCK_EX)' || return  # one process at a time; freed when it ends
  is_complete && return
  rm -f "$venv/.fingerprint"
  rm -rf "$venv"
  if command -v uv >/dev/null 2>&1; then
    echo "evoexp: creating $venv with uv (once, about a minute)" >&2
    uv venv --quiet --python "$base" "$venv" || return
    # Bytecode ahead of use only where Python may not write it on first use; every start would take seconds longer.
    tool=(uv pip install --quiet ${PYTHONDONTWRITEBYTECODE:+--compile-bytecode} --python "$PYTHON")
  else
    echo "evoexp: creating $venv with pip (once, some minutes; uv is faster)" >&2
    "$base" -m venv "$venv" || return
    tool=("$PYTHON" -m pip install --quiet --disable-pip-version-check)
  fi
  # The build tools first: one dependency exists only as a source archive, and its build must not fetch others.
  awk '/^[^ ]/ { wanted = /^(packaging|setuptools|wheel)==/ } wanted' "$root/requirements.lock" >"$venv/build.lock" &&
    "${tool[@]}" --require-hashes --no-deps -r "$venv/build.lock" &&
    "${tool[@]}" --require-hashes --no-build-isolation -r "$root/requirements.lock" &&
    "${tool[@]}" --no-deps --no-build-isolation -e "$root" &&
    printf '%s' "$fingerprint" >"$venv/.fingerprint"
}

if ! is_complete; then
  if ! install >&2; then
    echo "evoexp: the environment could not be installed (see above)" >&2
    exit 2
  fi
  exec 9<&-
fi
