// SPDX-License-Identifier: GPL-3.0-or-later
// What a frame tells about its work, a part of patina.h, which includes it. Its conventions and thread rules hold here too.
#ifndef PATINA_DIAGNOSTICS_H
#define PATINA_DIAGNOSTICS_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- statistics, the plan, and planes --------------------------------------------------------------------------------

// Statistics of the last render as a JSON object. Returns its full length; truncates to size.
//   "passes":{..}, "skipped":{..}: milliseconds by pass, and why each other pass was left out.
//   "layers":[{"points":..,"pixels":..},..]: points in chunks that were scattered, and pixels covered; no pixels without peeling.
//   "lights":[{"samples":..,"error":..},..]: of the casting lights' shadows.
//   "planes":{"peak":..,"held":..}: bytes that the plan came to before it ran, without light maps, and bytes held after it, with them.
//   "soft":{"parts":..,"records":..}, with soft points: parts they are drawn in, and records of the largest, 80 bytes each in peak.
//   "samples":{"grid":..,"shifts":..}: pixel_samples as pixels on each side of one, times shifted.
//   "gl":{"dispatches":..,"empty":..,"barriers":..,"calls":..,"copies":..,"waits":..,"uploaded":..,"bytes":..}, OpenGL: what was asked of
//     it. empty: dispatches without a workgroup, indirect ones in measured frames only. copies: between buffers, and into parts of them.
//     waits: calls that block until submitted work is done. uploaded: bytes handed over. bytes: as below.
//   "cpu":{"barriers":..,"bytes":..}, processor: steps of several threads, each of which ends when all are done; and bytes that the
//     passes read and write by the plan, each of their buffers whole.
//   "work":{"PASS":{..},..}: the fields of "gl" or "cpu" for each pass.
PATINA_API size_t patina_frame_stats_json(const patina_frame *frame, char *buffer, size_t size);
// The plan as text, a line a pass, without rendering. Returns the full length.
PATINA_API size_t patina_frame_plan_text(patina_frame *frame, const patina_scene *scene, char *buffer, size_t size);
// 1: from the next render on no planes share memory, so that patina_frame_dump_planes has them all; takes more of it. 0: as at first.
PATINA_API int patina_frame_keep_planes(patina_frame *frame, uint32_t keep);
// 1: from the next render on a GPU times each pass by itself, and empty indirect dispatches are counted. That costs a few calls for each
// pass. 0, as at first: a GPU times the passes over points, and all others between them together, by the name "pixels".
PATINA_API int patina_frame_measure(patina_frame *frame, uint32_t measure);
// Writes every plane of the last render as a raw little-endian file into a folder, with a .txt line of its shape. Bins of discs are not
// written, nor planes whose memory others took.
PATINA_API int patina_frame_dump_planes(const patina_frame *frame, const char *folder);

#ifdef __cplusplus
}
#endif
#endif
