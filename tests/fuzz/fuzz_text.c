// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target: any bytes as XYZ, CSV or PTS. So that they are not taken for a PLY file, a first line that says what
// follows may be put before them: the low bits of the last byte choose it.
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const heads[8] = {"",
                                         "1 2 3\n",
                                         "2\n",
                                         "x,y,z,red,green,blue\n",
                                         "1 2 3 0 0 1 9 9 9\n",
                                         "X Y Z nx ny nz a\n",
                                         "# a\n1;2;3;4\n",
                                         "1 2 3 0.5 0.25 1\n"};
    const char *head = size ? heads[data[size - 1] & 7] : heads[0];
    size_t before = strlen(head);
    uint8_t *text = malloc(before + size + 1);
    REQUIRE(text);
    memcpy(text, head, before);
    if (size)
        memcpy(text + before, data, size);
    fuzz_open_points(text, before + size);
    free(text);
    return 0;
}
