// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target: any bytes as a PLY file; what opens is read in full, column by column.
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_open_points(data, size);
    return 0;
}
