// SPDX-License-Identifier: GPL-3.0-or-later
// town OUT.cloud ACROSS [POINTS [LEVELS [plain]]]: a terraced town of ACROSS x ACROSS quarters with POINTS each (a million), written as a saved
// cloud, in so many levels (1); plain: without colours and footprints, 12 bytes a point.
#include "scenes/town.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int count, char **arguments)
{
    const unsigned long across = count > 2 ? strtoul(arguments[2], NULL, 10) : 0;
    const unsigned long points = count > 3 ? strtoul(arguments[3], NULL, 10) : 1000000;
    const unsigned long levels = count > 4 ? strtoul(arguments[4], NULL, 10) : 1;
    const int plain = count > 5 && !strcmp(arguments[5], "plain");
    if (count < 3 || across < 1 || across > 1000 || points < 1000 || points > 4000000 || levels < 1 || levels > 9) {
        fputs(
            "town OUT.cloud ACROSS [POINTS [LEVELS [plain]]]: 1 to 1000 quarters a side, of 1000 to 4000000 points each, in 1 "
            "to 9 levels\n",
            stderr);
        return 2;
    }
    const uint64_t bytes = town_write(arguments[1], (uint32_t)across, (uint32_t)points, (uint32_t)levels, plain);
    printf("{\"points\": %llu, \"bytes\": %llu}\n", (unsigned long long)(across * across * points), (unsigned long long)bytes);
    return 0;
}
