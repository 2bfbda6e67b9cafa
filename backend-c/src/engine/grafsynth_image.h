/* The common part of the engines of grafsynth: reading images. docs/c.md of grafsynth describes images. */
#ifndef GRAFSYNTH_IMAGE_H
#define GRAFSYNTH_IMAGE_H

#include <stdbool.h>
#include <stdint.h>

/* The memory of images. For images in RAM (copied from an EEPROM), define GS_ROM as const in all files. */
#ifndef GS_ROM
#if defined(__AVR__) && defined(__FLASH)
#define GS_ROM const __flash
#elif defined(__SDCC_mcs51)
#define GS_ROM const __code
#else
#define GS_ROM const
#endif
#endif

/* sdcc compiles calls better than inlined code. */
#if defined(__SDCC_mcs51)
#define GS_INLINE static
#else
#define GS_INLINE static inline
#endif

/* sdcc places temporaries of a function in the 128 bytes of internal RAM of an 8051; functions with many of them use the stack instead. */
#if defined(__SDCC_mcs51)
#define GS_ON_STACK __reentrant
#else
#define GS_ON_STACK
#endif

/* The results of a check. */
#define GS_OK 0U
#define GS_SHORT 1U     /* fewer bytes than the header or the length requires */
#define GS_MAGIC 2U     /* not an image */
#define GS_VERSION 3U   /* an image for another engine */
#define GS_CRC 4U       /* corrupt */
#define GS_INTERFACE 5U /* made for other inputs or outputs */
#define GS_ROOM 6U      /* larger than the instance */
#define GS_RANGE 7U     /* refers to something that it does not contain */

/* The header of all images. */
#define GS_AT_KIND 5U
#define GS_AT_LENGTH 6U
#define GS_AT_CRC 8U
#define GS_AT_INTERFACE 12U

GS_INLINE uint16_t gs_u16(GS_ROM uint8_t *image, uint16_t at)
{
    const uint16_t low = image[at];
    const uint16_t high = image[(uint16_t)(at + 1U)];
    return (uint16_t)(low | (uint16_t)(high << 8));
}

GS_INLINE uint32_t gs_u32(GS_ROM uint8_t *image, uint16_t at)
{
    const uint32_t low = gs_u16(image, at);
    const uint32_t high = gs_u16(image, (uint16_t)(at + 2U));
    return low | (high << 16);
}

/* Interprets a number as two's complement, on every machine. */
GS_INLINE int32_t gs_signed(uint32_t value)
{
    int32_t result;
    if (value <= 0x7FFFFFFFU) {
        result = (int32_t)value;
    } else {
        const uint32_t below = 0xFFFFFFFFU - value;
        result = -(int32_t)below - 1;
    }
    return result;
}

GS_INLINE int32_t gs_i32(GS_ROM uint8_t *image, uint16_t at)
{
    return gs_signed(gs_u32(image, at));
}

/* The CRC-32 of all bytes; those of the CRC itself count as 0. */
GS_INLINE uint32_t gs_crc(GS_ROM uint8_t *image, uint16_t length)
{
    uint32_t crc = 0xFFFFFFFFU;
    for (uint16_t at = 0U; at < length; ++at) {
        const bool own = (at >= GS_AT_CRC) && (at < GS_AT_INTERFACE);
        crc ^= own ? 0U : image[at];
        for (uint8_t bit = 0U; bit < 8U; ++bit) {
            crc = ((crc & 1U) != 0U) ? ((crc >> 1) ^ 0xEDB88320U) : (crc >> 1);
        }
    }
    return crc ^ 0xFFFFFFFFU;
}

/* A bit of an instance. */
GS_INLINE bool gs_bit(const uint8_t *bits, uint16_t at)
{
    return (((uint16_t)bits[at >> 3] >> (at & 7U)) & 1U) != 0U;
}

GS_INLINE void gs_put(uint8_t *bits, uint16_t at, bool value)
{
    const uint8_t mask = (uint8_t)(1U << (at & 7U));
    const uint16_t byte = at >> 3;
    if (value) {
        bits[byte] = (uint8_t)(bits[byte] | mask);
    } else {
        bits[byte] = (uint8_t)(bits[byte] & (uint8_t)~mask);
    }
}

#endif
