// SPDX-License-Identifier: GPL-3.0-or-later
// The features that tell trust, in their order in memory and in files for training. All are ratios: no unit and no scale of a cloud
// matters. d1, d4, d8, d16: distances to the 1st, 4th, ... neighbor; reach: a neighbor's own d16; plane: through the point and its 16.
#ifndef PT_TRUST_FEATURES_H
#define PT_TRUST_FEATURES_H

#define PT_TRUST_FEATURE_LIST(X)                                                                                               \
    X(REACH_MEAN, "d16 over the mean reach of the 16")                                                                         \
    X(REACH_LEAST, "d16 over the least reach of the 16")                                                                       \
    X(REACH_NEAR, "d8 over the mean reach of the nearest 8")                                                                   \
    X(REACH_SPREAD, "greatest over least reach of the 16")                                                                     \
    X(D1, "d1 over d16")                                                                                                       \
    X(D2, "d2 over d16")                                                                                                       \
    X(D4, "d4 over d16")                                                                                                       \
    X(D8, "d8 over d16")                                                                                                       \
    X(MUTUAL, "how many of the 16 have the point within their reach")                                                          \
    X(MUTUAL_NEAR, "how many of the nearest 8 have it within half of their reach")                                             \
    X(OFFSET, "distance to the mean of the 16 over d16")                                                                       \
    X(OFFSET_NEAR, "distance to the mean of the nearest 8 over d8")                                                            \
    X(FLATNESS, "least over middle variance of the plane")                                                                     \
    X(LINEARITY, "middle over greatest variance of the plane")                                                                 \
    X(RESIDUAL, "distance from the plane over d16")                                                                            \
    X(RESIDUAL_SIGMA, "distance from the plane over its standard deviation")                                                   \
    X(PLANES_LEAST, "least distance from the planes of the nearest 8 over d16")                                                \
    X(PLANES_MEAN, "mean distance from the planes of the nearest 8 over d16")                                                  \
    X(PLANES_SIGMA, "least distance from the planes of the nearest 8, in their sigmas")                                        \
    X(PLANES_SIGMA_MEAN, "mean distance from the planes of the nearest 8, in their sigmas")                                    \
    X(NORMALS_MEAN, "mean |cosine| between the plane's normal and those of the nearest 8")                                     \
    X(NORMALS_LEAST, "least of these")                                                                                         \
    X(NORMALS, "how many of the nearest 8 have a normal")                                                                      \
    X(KIND, "patina_kind of the point")                                                                                        \
    X(SURFACES, "how many of the 16 are surface or border")                                                                    \
    X(LINES, "how many of the 16 are lines")                                                                                   \
    X(SIGMA, "the point's sigma over d16")                                                                                     \
    X(SIGMAS, "mean sigma of the 16 over d16")                                                                                 \
    X(MAJOR, "greater half axis of the footprint over d16")                                                                    \
    X(SPARSE, "d16 over the spacing of the chunk")                                                                             \
    X(ALONG, "|cosine| between the line of sight and the longest axis; -1 without stations")                                   \
    X(FACING, "|cosine| between the line of sight and the plane's normal; -1 without stations")                                \
    X(INTERVAL, "d16 over the way to the scan's next sample; 0 where this is not known")

enum pt_trust_feature {
#define PT_X(name, text) PT_TRUST_##name,
    PT_TRUST_FEATURE_LIST(PT_X)
#undef PT_X
};

#endif
