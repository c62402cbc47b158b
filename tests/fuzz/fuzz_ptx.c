// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target: any bytes as a PTX file; and as the rows behind a scan's header, whose grid the first two bytes choose.
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_open_points(data, size);
    if (size < 2)
        return 0;
    uint8_t *text = malloc(size + 128);
    REQUIRE(text);
    int before = sprintf((char *)text, "%d\n%d\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n5 6e5 7 1\n",
                         data[0] % 40, data[1] % 40);
    memcpy(text + before, data + 2, size - 2);
    fuzz_open_points(text, (size_t)before + size - 2);
    free(text);
    return 0;
}
