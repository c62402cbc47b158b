// SPDX-License-Identifier: GPL-3.0-or-later
#include "roles.h"
#include "base/words.h"

#include <stddef.h>
#include <string.h>

struct known_name {
    const char *name;
    enum role role;
};

static const struct known_name known_names[] = {
    {"x", X},     {"y", Y},    {"z", Z},     {"easting", X},   {"northing", Y},  {"elevation", Z}, {"height", Z},
    {"nx", NX},   {"ny", NY},  {"nz", NZ},   {"normal_x", NX}, {"normal_y", NY}, {"normal_z", NZ}, {"r", RED},
    {"g", GREEN}, {"b", BLUE}, {"a", ALPHA}, {"red", RED},     {"green", GREEN}, {"blue", BLUE},   {"alpha", ALPHA},
};

// Where the names above give no place; in UTF-8, and as older Windows writes it.
static const struct known_name other_names[] = {
    {"e", X},          {"n", Y},        {"h", Z},           {"east", X},  {"north", Y},       {"elev", Z},    {"alt", Z},
    {"rechtswert", X}, {"hochwert", Y}, {"h\xC3\xB6he", Z}, {"hoehe", Z}, {"h\xC3\x96HE", Z}, {"h\xF6he", Z},
};

// "X [m]", "Easting(m)", "XCOORD", "pos_x" → the name by which it is known: without its unit, and of one letter without what
// says that it is a coordinate.
static void plain_name(char plain[NAME_SIZE], const char *name)
{
    static const char *const marks[] = {"coordinate", "coord", "position", "pos", "point"};
    size_t length = strcspn(name, "[(");
    while (length && (name[length - 1] == ' ' || name[length - 1] == '_'))
        length--;
    for (size_t i = 0; i < sizeof marks / sizeof *marks; i++) {
        size_t mark = strlen(marks[i]), gap = length > mark + 1;
        if (length != mark + 1 + gap)
            continue;
        bool before = pt_same_start(name, marks[i], mark), behind = pt_same_start(name + length - mark, marks[i], mark);
        if ((before || behind) && (!gap || strchr("_ .", name[before ? mark : 1]))) {
            name += before ? length - 1 : 0;
            length = 1;
            break;
        }
    }
    memcpy(plain, name, length);
    plain[length] = 0;
}

bool pt_roles_have(const enum role roles[], uint32_t width, enum role first)
{
    uint32_t found = 0;
    for (uint32_t c = 0; c < width; c++)
        for (uint32_t k = 0; k < 3; k++)
            found |= (uint32_t)(roles[c] == first + k) << k;
    return found == 7;
}

static void find_names(enum role roles[], char (*columns)[NAME_SIZE], uint32_t width, const struct known_name *names,
                       size_t count)
{
    for (uint32_t c = 0; c < width; c++) {
        char plain[NAME_SIZE];
        plain_name(plain, columns[c]);
        for (size_t k = 0; k < count && roles[c] == ATTRIBUTE; k++) {
            bool taken = false;
            for (uint32_t other = 0; other < width; other++)
                taken |= roles[other] == names[k].role;
            if (!taken && pt_same_word(plain, names[k].name))
                roles[c] = names[k].role;
        }
    }
}

void pt_roles_by_name(enum role roles[], char (*columns)[NAME_SIZE], uint32_t width)
{
    find_names(roles, columns, width, known_names, sizeof known_names / sizeof *known_names);
    if (!pt_roles_have(roles, width, X))
        find_names(roles, columns, width, other_names, sizeof other_names / sizeof *other_names);
    for (uint32_t c = 0; c < width; c++) {
        bool normal = roles[c] >= NX && roles[c] <= NZ, color = roles[c] >= RED;
        if ((normal && !pt_roles_have(roles, width, NX)) || (color && !pt_roles_have(roles, width, RED)))
            roles[c] = ATTRIBUTE;
    }
}
