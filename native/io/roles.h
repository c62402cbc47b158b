// SPDX-License-Identifier: GPL-3.0-or-later
// What a column of a table is, by its name.
#ifndef PT_ROLES_H
#define PT_ROLES_H

#include <stdbool.h>
#include <stdint.h>

enum { NAME_SIZE = 64 }; // of a column, with its 0

enum role { ATTRIBUTE, X, Y, Z, NX, NY, NZ, RED, GREEN, BLUE, ALPHA };

// Sets the roles of columns that are attributes so far, as their names say: upper and lower case, a unit in brackets behind and
// "coord" or "pos" beside a letter do not matter. A name that comes twice, or a family that is not whole, stays an attribute.
void pt_roles_by_name(enum role roles[], char (*columns)[NAME_SIZE], uint32_t width);

// Whether there are all three of X Y Z, NX NY NZ, or RED GREEN BLUE; first: the first of them.
bool pt_roles_have(const enum role roles[], uint32_t width, enum role first);

#endif
