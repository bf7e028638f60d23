# What the scripts of this folder share. Sourced.

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"

# Debian's colcon and rosidl belong to Debian's python, whatever comes first in PATH.
export PATH="/usr/bin:$PATH"

step() { printf '== %s\n' "$*"; }

fail() {
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}
