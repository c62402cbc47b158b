// SPDX-License-Identifier: GPL-3.0-or-later
// The library's version as text: patina_version(), and what files say of who wrote them.
#ifndef PT_VERSION_H
#define PT_VERSION_H

#include "patina/patina.h"

#define PT_VERSION_TEXT_(x) #x
#define PT_VERSION_TEXT(x) PT_VERSION_TEXT_(x)
#define PT_VERSION                                                                                                             \
    PT_VERSION_TEXT(PATINA_VERSION_MAJOR)                                                                                      \
    "." PT_VERSION_TEXT(PATINA_VERSION_MINOR) "." PT_VERSION_TEXT(PATINA_VERSION_PATCH)

#endif
