// SPDX-License-Identifier: GPL-3.0-or-later
// Chunks beside each other in a file's table, taken together: of a billion points a plan looks at what lies around so many at once, and at
// the chunks of those alone that may show. What lies around is no smaller, and a cluster says no more than its chunks say: which of them a
// picture draws does not depend on there being clusters.
#ifndef PT_CLUSTERS_H
#define PT_CLUSTERS_H

#include "cloud.h"

enum { PT_CLUSTER = 64 };

struct pt_cluster {
    struct pt_chunk
        around; // box, reach, footprint and spacing that none of its chunks exceeds; gap: 0 where one of them has none
    double finest, coarsest; // gaps; 0: there are none
    int known;               // 0: some number of it is none, nothing follows from the cluster
};

// Of a cloud whose table of chunks will not change but by another call; what there was is freed. Without memory, or of few chunks, there are
// none.
void pt_clusters_make(struct patina_cloud *cloud);

// The place of what lies around all within a box, a little wider than this.
void pt_cluster_box(const double low[3], const double high[3], struct pt_chunk *around);

#endif
