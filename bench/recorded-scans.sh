# SPDX-FileCopyrightText: The tessera authors
# SPDX-License-Identifier: Apache-2.0
# Read by scripts that have $here and fail(): sets data to the folder of recorded
# scans that TESSERA_DATA names, or to ../shared/data, which need not be there.
if [ -n "${TESSERA_DATA:-}" ]; then
  data=$(cd "$TESSERA_DATA" && pwd) || fail "TESSERA_DATA names no folder: $TESSERA_DATA"
  [ -d "$data/semantickitti_08" ] || fail "TESSERA_DATA holds no semantickitti_08: $TESSERA_DATA"
else
  data=$here/../shared/data
fi
