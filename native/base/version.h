// SPDX-License-Identifier: GPL-3.0-or-later
// The library's version as text: patina_version(), and what files say of who wrote them. build/stamp makes it of the sources.
#ifndef PT_VERSION_H
#define PT_VERSION_H

extern const char pt_version[];

#endif
