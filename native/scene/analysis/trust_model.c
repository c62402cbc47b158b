// SPDX-License-Identifier: GPL-3.0-or-later
// Boosted trees over the features of a point. The constants are written by tests/truth/scans/trust.py.
#include "trust.h"
#include "shared/words.h"

struct node {         // a tree lies in preorder: the left child follows, the right one lies `value` nodes on
    float most;       // features up to this go left
    int16_t value;    // of a leaf: its score
    uint16_t feature; // LEAF: none
};

#define LEAF 0xFFFFu

#include "trust_constants.h"

static int32_t score_of(const struct node *node, const float *features)
{
    while (node->feature != LEAF)
        node += features[node->feature] <= node->most ? 1 : node->value;
    return node->value;
}

uint32_t pt_trust_level(const float features[PT_TRUST_FEATURES])
{
    int32_t score = FIRST_SCORE;
    uint32_t level = 0;
    for (uint32_t tree = 0; tree < TREES; tree++) {
        if (tree == SURE_AFTER && score >= SURE_SCORE)
            return PT_TRUST_LEVELS - 1;
        score += score_of(nodes + roots[tree], features);
    }
    while (level < PT_TRUST_LEVELS - 1 && score >= least_scores[level])
        level++;
    return level;
}
