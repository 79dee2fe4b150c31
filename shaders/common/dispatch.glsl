// SPDX-License-Identifier: MIT
// Size of a work group, and the item of a one-dimensional list that this invocation processes. The counterpart of
// gpu_dispatch(), which spreads more groups than an axis may have over y: the caller skips items beyond its count. A pass
// with another size than 64 defines GROUP_SIZE before it includes this.
#ifndef GROUP_SIZE
#define GROUP_SIZE 64
#endif

layout(local_size_x = GROUP_SIZE) in;

uint item_index()
{
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * GROUP_SIZE + gl_LocalInvocationIndex;
}
