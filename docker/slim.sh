#!/bin/sh
# Takes out of an environment (its folder is the argument) what no program runs: installers, tests, stubs, headers, and
# where there is a strip the names of functions in zenoh.
set -eu
"$1/bin/pip" uninstall --quiet --yes setuptools pip
find "$1" -type d \( -name tests -o -path '*/numpy/_core/include' \) -prune -exec rm -rf {} +
find "$1" -type f \( -name '*.pyi' -o -name '*.pxd' -o -name 'libnpy*.a' \) -delete
# Extension modules that nothing but NumPy's tests import.
find "$1" -type f -path '*/numpy/_core/*' \( -name '_simd.*.so' -o -name '*_tests.*.so' \) -delete
if command -v strip >/dev/null; then
  # No others: libraries that were put together after they were linked do not survive it.
  find "$1" -name 'zenoh.abi3.so' -exec strip --strip-unneeded {} +
fi
