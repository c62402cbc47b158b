// SPDX-License-Identifier: GPL-3.0-or-later
#include "drawing.h"

#include <stdio.h>

char *pt_draw_number(double value, int digits, char text[40])
{
    snprintf(text, 40, "%.*g", digits, value == 0.0 ? 0.0 : value); // no -0
    for (char *at = text; *at; at++)
        if (*at == ',')
            *at = '.';
    return text;
}
