// SPDX-License-Identifier: GPL-3.0-or-later
// Small pictures of soft points: what their tests share.
#ifndef TEST_SOFT_H
#define TEST_SOFT_H

#include "support.h"

#include <string.h>

enum { WIDTH = 96, HEIGHT = 72 };

static const float background[3] = {0.1f, 0.2f, 0.4f};

static inline patina_cloud_style soft_style(uint32_t model)
{
    patina_cloud_style style = PATINA_CLOUD_STYLE_INIT;
    style.soft = PATINA_SOFT_ALL;
    style.soft_model = model;
    style.soft_opacity = 1.0f;
    style.lighting = PATINA_LIGHTING_UNLIT;
    return style;
}

static inline patina_settings plain_settings(void)
{
    patina_settings settings = settings_default(WIDTH, HEIGHT);
    settings.own_background = 1;
    memcpy(settings.background, background, sizeof background);
    return settings;
}

#endif
