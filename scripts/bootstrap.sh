# Sourced by the scripts beside it: makes sure that .venv holds exactly what requirements.lock says, then sets PYTHON.
#
# The environment is rebuilt when the lock or the project's metadata change; uv is used where it is installed (four times
# faster), pip otherwise. Nothing but Python >= 3.11 is needed beforehand.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv="${EVOEXP_VENV:-$root/.venv}"
PYTHON="$venv/bin/python"

find_python() {
  for candidate in "${EVOEXP_PYTHON:-}" python3 python3.13 python3.12 python3.11; do
    if [ -n "$candidate" ] && command -v "$candidate" >/dev/null 2>&1 &&
      "$candidate" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' >/dev/null 2>&1; then
      command -v "$candidate"
      return
    fi
  done
  echo "evoexp: needs Python 3.11, 3.12 or 3.13 on PATH (or its path in EVOEXP_PYTHON)" >&2
  exit 2
}

install_locked() {
  local base
  base=$(find_python) || exit 2
  echo "evoexp: creating $venv from requirements.lock (once, about a minute)" >&2
  rm -rf "$venv"
  if command -v uv >/dev/null 2>&1; then
    uv venv --quiet --python "$base" "$venv" >&2 &&
      uv pip install --quiet --python "$PYTHON" --require-hashes -r "$root/requirements.lock" >&2 &&
      uv pip install --quiet --python "$PYTHON" --no-deps --no-build-isolation -e "$root" >&2
  else
    # The build tools first: one dependency exists only as a source archive, and its hashed build must not fetch others.
    "$base" -m venv "$venv" >&2 &&
      grep -A 3 -E '^(setuptools|wheel|packaging)==' "$root/requirements.lock" | grep -v -E '^(--|.*# via)' >"$venv/build.lock" &&
      "$PYTHON" -m pip install --quiet --disable-pip-version-check --require-hashes --no-deps -r "$venv/build.lock" >&2 &&
      "$PYTHON" -m pip install --quiet --disable-pip-version-check --require-hashes --no-build-isolation -r "$root/requirements.lock" >&2 &&
      "$PYTHON" -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e "$root" >&2
  fi
}

fingerprint=$(cat "$root/requirements.lock" "$root/pyproject.toml" | cksum)
if [ ! -x "$PYTHON" ] || [ "$(cat "$venv/.fingerprint" 2>/dev/null)" != "$fingerprint" ]; then
  if ! install_locked; then
    rm -rf "$venv"
    echo "evoexp: the environment could not be installed (see above)" >&2
    exit 2
  fi
  printf '%s' "$fingerprint" >"$venv/.fingerprint"
fi
