// SPDX-License-Identifier: GPL-3.0-or-later
// TEST_SANITIZED: whether a sanitizer keeps memory of its own, so that what the process holds does not tell what the library holds.
#ifndef PT_SANITIZED_H
#define PT_SANITIZED_H

#define TEST_SANITIZED 0
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#undef TEST_SANITIZED
#define TEST_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#undef TEST_SANITIZED
#define TEST_SANITIZED 1
#endif
#endif

#endif
